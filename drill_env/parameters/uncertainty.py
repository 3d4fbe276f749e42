"""Uncertainty sets L0-L3: how far a plant may lie from the nominal rig."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from drill_env._checks import real, reals
from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.parameters.rig import Rig

Level: TypeAlias = Literal["L0", "L1", "L2", "L3"]


# s: two swings of the string, as an encoder's.
_LONGEST_DELAY = 10.0


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Uniform ranges, relative unless said otherwise.

    Args:
        friction: lower and upper factor on the whole lower friction law.
        hump: +- share of T1 and of T2, drawn separately.
        bu: +- share.
        ktheta: +- share.
        Jl: +- share.
        Tsu: +- share.
        delay_s: largest sensor delay, s.
    """

    friction: tuple[float, float] = (1.0, 1.0)
    hump: float = 0.0
    bu: float = 0.0
    ktheta: float = 0.0
    Jl: float = 0.0
    Tsu: float = 0.0
    delay_s: float = 0.0

    def __post_init__(self) -> None:
        low, high = reals(self.friction, "uncertainty friction", 2)
        if not 0 <= low <= high:
            raise InputError(f"uncertainty friction is {low}, {high}: give 0 <= low <= high")
        for name in ("hump", "bu", "ktheta", "Jl", "Tsu"):
            share = real(getattr(self, name), f"uncertainty {name}")
            if not 0 <= share < 1:
                raise InputError(f"uncertainty {name} is {share}: give a share, 0 to less than 1")
        if not 0 <= real(self.delay_s, "uncertainty delay_s") <= _LONGEST_DELAY:
            raise InputError(
                f"uncertainty delay_s is {self.delay_s}: give 0 to {_LONGEST_DELAY:g} s"
            )

    def draw(self, uniforms: FloatArray) -> FloatArray:
        """One plant from eight numbers in [0, 1).

        Returns:
            Factors on (friction, T1, T2, bu, ktheta, Jl, Tsu), then the delay in s.
        """
        low, high = self.friction
        spread = np.array([self.hump, self.hump, self.bu, self.ktheta, self.Jl, self.Tsu])
        out = np.empty(8)
        out[0] = low + (high - low) * uniforms[0]
        out[1:7] = 1.0 + spread * (2.0 * uniforms[1:7] - 1.0)
        out[7] = self.delay_s * uniforms[7]
        return out


UNCERTAINTY: dict[Level, Uncertainty] = {
    "L0": Uncertainty(),
    "L1": Uncertainty((0.8, 1.2), 0.10, 0.03, 0.05, 0.05, 0.10, 0.020),
    "L2": Uncertainty((0.5, 1.5), 0.15, 0.08, 0.15, 0.10, 0.30, 0.100),
    "L3": Uncertainty((0.3, 2.5), 0.15, 0.15, 0.30, 0.20, 0.50, 0.200),
}


def uncertainty(level: Level | Uncertainty) -> Uncertainty:
    """The set of a level name; a set passes through.

    Raises:
        InputError: the name is unknown.
    """
    if isinstance(level, Uncertainty):
        return level
    if not isinstance(level, str) or level not in UNCERTAINTY:
        raise InputError(f"uncertainty is {level!r}: give one of {', '.join(UNCERTAINTY)}")
    return UNCERTAINTY[level]


def perturb_record(p: np.ndarray, factors: FloatArray) -> None:
    """Apply a drawn plant to one record of parameters, in place."""
    for name in ("Tsl", "T1", "T2", "bl"):
        p[name] *= factors[0]
    for name, factor in zip(("T1", "T2", "bu", "ktheta", "Jl", "Tsu"), factors[1:7], strict=True):
        p[name] *= factor
    p["per_Jl"] = 1.0 / p["Jl"]


def perturb(rig: Rig, factors: FloatArray) -> Rig:
    """The rig of a drawn plant; the delay is the sensors' business."""
    f = factors
    return rig.replace(
        Tsl=rig.Tsl * f[0], bl=rig.bl * f[0], T1=rig.T1 * f[0] * f[1], T2=rig.T2 * f[0] * f[2],
        bu=rig.bu * f[3], ktheta=rig.ktheta * f[4], Jl=rig.Jl * f[5], Tsu=rig.Tsu * f[6],
    )  # fmt: skip
