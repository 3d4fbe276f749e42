"""A rig with candidates fitted to the windows of recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drill_env._threads import each
from drill_env._types import FloatArray
from drill_env.parameters import Rig
from drill_env.prediction._descent import Descent, errors_of_rig, rig_at
from drill_env.prediction.candidate import Candidate
from drill_env.prediction.cut import Cut, rounding_of
from drill_env.prediction.likelihood import log_density, scales
from drill_env.prediction.setting import Setting


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A rig with candidates at its best.

    Attributes:
        setting: what it was fitted to.
        vector: coordinates of the rig and its given effects, and the drive's shift in intervals.
        candidates: what is added.
        numbers: of each.
        errors: of all windows, shape (w, k, c).
        size: scales of the errors, shape (k, c).
        value: log density of all windows and of the rig, nats.
    """

    setting: Setting
    vector: FloatArray
    candidates: tuple[Candidate, ...]
    numbers: tuple[FloatArray, ...]
    errors: FloatArray
    size: FloatArray
    value: float

    @property
    def rig(self) -> Rig:
        """With what was added among its effects."""
        return rig_at(self.setting, self.candidates, self.packed)

    @property
    def packed(self) -> FloatArray:
        """All numbers in one vector."""
        return np.concatenate([self.vector, *self.numbers])

    def judged(self, cuts: Sequence[Cut]) -> FloatArray:
        """Log density of each window of other recordings at each lead, shape (w, k).

        Their scale is their own: what counts is the logarithm of a model's error. By that of the
        fitted recordings a better model could lose where others are disturbed more.
        """
        degrees = self.setting.criteria.degrees
        errors = errors_of(self, cuts)
        size = scales(errors, degrees, least=rounding_of(cuts))
        return log_density(errors, size, degrees)


def errors_of(here: Fit, cuts: Sequence[Cut]) -> FloatArray:
    """Errors of a fit's predictions of recordings, shape (w, k, c)."""
    return errors_of_rig(here.rig, float(here.vector[-1]), cuts)


def fit(
    setting: Setting, vector: FloatArray, candidates: Sequence[Candidate] = (),
    numbers: Sequence[FloatArray] = (),
) -> Fit:  # fmt: skip
    """Gauss-Newton descent with damping, robust weights and bounds.

    Args:
        setting: windows and what is known of the rig.
        vector: coordinates of the rig and the shift, to start from.
        candidates: what is added to it.
        numbers: of each candidate, to start from.
    """
    candidates = tuple(candidates)
    here = Descent(setting, candidates).run(np.concatenate([vector, *numbers]))
    own = len(vector)
    ends = np.cumsum([own, *[c.size for c in candidates]])
    parts = tuple(here.x[a:b].copy() for a, b in zip(ends, ends[1:], strict=False))
    return Fit(setting, here.x[:own].copy(), candidates, parts, here.errors, here.size, here.value)


def slopes(here: Fit) -> FloatArray:
    """Derivatives of all errors by the rig's coordinates and the shift, shape (w, k, c, m)."""
    return all_slopes(here)[..., : len(here.vector)]


def all_slopes(here: Fit) -> FloatArray:
    """Derivatives of all errors by all numbers, shape (w, k, c, m)."""
    return Descent(here.setting, here.candidates).slopes(here.packed, here.errors)


def spread_of(here: Fit) -> FloatArray:
    """Standard deviations of all numbers before the recordings, infinite where nothing is known."""
    return Descent(here.setting, here.candidates).spread


def errors_of_each(
    setting: Setting, rigs: Sequence[Rig | None], shift: float
) -> list[FloatArray | None]:
    """Errors of all windows under each rig; nothing where there is none."""

    def one(rig: Rig | None) -> FloatArray | None:
        return None if rig is None else errors_of_rig(rig, shift, setting.cuts)

    return each(one, rigs)
