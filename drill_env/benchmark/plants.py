"""The frozen plants of the protocol: drawn once from a seed, kept in a file, checked by a hash."""

from __future__ import annotations

import functools
import hashlib
import io
from dataclasses import dataclass
from importlib.resources import files
from typing import get_args

import numpy as np
import pandas as pd

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.parameters import Level, Rig, uncertainty
from drill_env.parameters.uncertainty import perturb

LEVELS: tuple[Level, ...] = get_args(Level)
FACTORS = ("friction", "T1", "T2", "bu", "ktheta", "Jl", "Tsu", "delay_s")
FROZEN = 200

PLANTS_SHA256 = "cf943c751fe429909baab4a2e3754889d6eff6fcb1c3997fbabe6852b4901d7f"
"""Hash of plants.csv; a changed file is refused."""

_TEST_STREAM, _TRAINING_STREAM = 2004, 1995
_DIGITS = 6


@dataclass(frozen=True, slots=True)
class Plants:
    """Plants of one level.

    Attributes:
        level: uncertainty set they were drawn from.
        factors: as `Uncertainty.draw` returns them, shape (n, 8).
    """

    level: Level
    factors: FloatArray

    def __len__(self) -> int:
        return len(self.factors)

    def rigs(self, nominal: Rig) -> list[Rig]:
        """Each plant as a rig."""
        return [perturb(nominal, row) for row in self.factors]

    @property
    def delays(self) -> FloatArray:
        """Sensor delays, s, shape (n,)."""
        return self.factors[:, 7]


def _draw(level: Level, count: int, stream: int) -> FloatArray:
    # One stream a level, filled row by row: more plants never change the first ones.
    uniforms = np.random.default_rng([stream, LEVELS.index(level)]).random((count, 8))
    spread = uncertainty(level)
    return np.round(np.array([spread.draw(row) for row in uniforms]), _DIGITS)


def _table() -> str:
    """What plants.csv must hold."""
    rows = [
        pd.DataFrame(_draw(level, FROZEN, _TEST_STREAM), columns=list(FACTORS)).assign(level=level)
        for level in LEVELS
    ]
    table = pd.concat(rows)[["level", *FACTORS]]
    return table.to_csv(index=False, float_format=f"%.{_DIGITS}f", lineterminator="\n")


@functools.cache
def _frozen() -> pd.DataFrame:
    content = (files("drill_env.benchmark") / "plants.csv").read_bytes()
    found = hashlib.sha256(content).hexdigest()
    if found != PLANTS_SHA256:
        raise InputError(
            f"plants.csv has the hash {found[:12]}, not {PLANTS_SHA256[:12]}: the frozen plants "
            "were changed; reinstall the package"
        )
    return pd.read_csv(io.BytesIO(content))


def frozen_plants(level: Level, count: int = FROZEN) -> Plants:
    """The first `count` test plants of a level, the same for every controller.

    Args:
        level: "L0" to "L3".
        count: up to 200 come from the file; further ones from the same stream.

    Raises:
        InputError: the level is unknown, the count is less than 1 or the file was changed.
    """
    if level not in LEVELS:
        raise InputError(f"level is {level!r}: give one of {', '.join(LEVELS)}")
    if count < 1:
        raise InputError(f"plants is {count}: give 1 or more")
    if count > FROZEN:
        return Plants(level, _draw(level, count, _TEST_STREAM))
    table = _frozen()
    return Plants(level, table.loc[table.level == level, list(FACTORS)].to_numpy()[:count])


def training_plants(level: Level, count: int) -> Plants:
    """Plants to tune on, from a stream of their own: none of them is a test plant."""
    return Plants(level, _draw(level, count, _TRAINING_STREAM))
