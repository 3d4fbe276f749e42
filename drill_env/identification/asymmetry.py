"""Is an axis' friction asymmetric, and what did the constant offset of a symmetric fit hold?

A constant offset and an asymmetry of the Coulomb level are one and the same force: with
Fc+ = Tsu + dTsu forth and Fc- = Tsu - dTsu back, friction is Tsu sign(v) + dTsu, at rest too.
No recording tells them apart, so the rig has one parameter, dTsu, for their sum. An asymmetry of
the viscous coefficient is another force, dbu abs(v); a fit without it lays its mean on the offset.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from drill_env._errors import InputError
from drill_env.identification.closed_loop import ClosedLoopResult, identify_closed_loop
from drill_env.identification.estimate import identify
from drill_env.identification.inverse_dynamics import InverseOptions, force_balance, relative_error
from drill_env.identification.position_law import PositionLaw
from drill_env.recordings import Recording

MODELS: Mapping[str, tuple[str, ...]] = {
    "symmetric": ("Ju", "Tsu", "bu"),
    "offset": ("Ju", "Tsu", "dTsu", "bu"),
    "viscous asymmetry": ("Ju", "Tsu", "bu", "dbu"),
    "both": ("Ju", "Tsu", "dTsu", "bu", "dbu"),
}
"""Free parameters of each model of an axis, its gain km given."""


@dataclass(frozen=True, slots=True)
class OffsetSplit:
    """The constant offset of a symmetric inverse-dynamics fit, taken apart.

    Attributes:
        before: offset of the symmetric fit, Nm or N.
        after: what stays constant once friction may be asymmetric (dTsu).
        alias: before - after: the share of dbu abs(v) that looked constant.
        dbu: asymmetry of the viscous coefficient.
        speed: alias / dbu, the constant that stands in for abs(v) in the symmetric fit.
        error_before: relative force error of the symmetric fit, share of 1.
        error_after: the same of the asymmetric one.
    """

    before: float
    after: float
    alias: float
    dbu: float
    speed: float
    error_before: float
    error_after: float

    @property
    def text(self) -> str:
        """What the numbers say."""
        share = abs(self.alias / self.before) if self.before else 0.0
        if share <= 0.5 or self.alias * self.before < 0:
            verdict = "is not an alias of the viscous asymmetry but stays"
        else:
            verdict = "is mostly an alias of the asymmetry of the friction"
        return (
            f"The offset of the symmetric model, {self.before:.4g}, {verdict}: with friction apart "
            f"for each direction {self.after:.3g} stays (dTsu, which an unequal Coulomb level and "
            f"a constant force share), and {self.alias:.4g} ({share:.0%}) was dbu abs(v) = "
            f"{self.dbu:.4g} abs(v), for which the symmetric model put a constant "
            f"{self.speed:.4g} in place of abs(v). Force error {self.error_before:.3%} before, "
            f"{self.error_after:.3%} after."
        )

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {**asdict(self), "text": self.text}


@dataclass(frozen=True, slots=True)
class AxisModel:
    """One model of the friction and how it fares.

    Attributes:
        name: key of `MODELS`.
        found: its closed-loop fit, with the force errors of simulation.
        bic: Bayesian information criterion of its prediction-error likelihood, without its
            constant; smaller is better.
    """

    name: str
    found: ClosedLoopResult
    bic: float

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return asdict(self)


def split_offset(
    fit: Sequence[Recording], gain: float, options: InverseOptions | None = None
) -> OffsetSplit:
    """Take the offset of the symmetric inverse-dynamics fit apart.

    Leaving a column out of a least-squares fit adds its coefficient times its regression on
    the columns that stay to theirs, so the split is exact.

    Args:
        fit: recordings with u and theta_u.
        gain: force or torque per volt.
        options: filter and decimation.

    Raises:
        InputError: there is no recording, or one does not fit.
    """
    if not fit:
        raise InputError("no recording to split the offset of; give at least one")
    options = options or InverseOptions()
    parts = [force_balance(r, gain, True, options)[:2] for r in fit]
    columns, force = (np.concatenate(part) for part in zip(*parts, strict=True))
    a, forth, back, plus, minus = columns.T
    # Sum and difference of the directions: the offset is the Coulomb level's asymmetry.
    speed = forth - back
    kept = np.stack([a, forth + back, plus + minus, plus - minus], axis=1)
    whole = np.column_stack([kept, speed])
    before = np.linalg.lstsq(kept, force, rcond=None)[0]
    after = np.linalg.lstsq(whole, force, rcond=None)[0]
    constant = float(np.linalg.lstsq(kept, speed, rcond=None)[0][3])
    return OffsetSplit(
        before=float(before[3]), after=float(after[3]), alias=float(after[4]) * constant,
        dbu=float(after[4]), speed=constant,
        error_before=relative_error(force, kept @ before),
        error_after=relative_error(force, whole @ after),
    )  # fmt: skip


def compare_asymmetry(
    fit: Sequence[Recording],
    gain: float,
    law: PositionLaw,
    *,
    holdout: Sequence[Recording] = (),
    models: Sequence[str] = tuple(MODELS),
    progress: Callable[[str, int, int], None] | None = None,
) -> tuple[AxisModel, ...]:
    """Fit each model of the friction in closed loop and by its prediction errors.

    Args:
        fit: recordings to fit together.
        gain: force or torque per volt.
        law: the position law.
        holdout: recordings to judge by.
        models: keys of `MODELS`.
        progress: called with (model, models done, all models).

    Returns:
        The models, smallest criterion first.

    Raises:
        InputError: an argument or a recording does not fit.
    """
    unknown = sorted(set(models) - set(MODELS))
    if unknown or not models:
        raise InputError(f"models: {', '.join(models)}: give names among {', '.join(MODELS)}")
    done: list[AxisModel] = []
    for name in models:
        if progress:
            progress(name, len(done), len(models))
        free = MODELS[name]
        found = identify_closed_loop(fit, gain, law, holdout=holdout, free=free)
        estimate = identify(fit, found.rig, free=free, fixed={"km": gain})
        done.append(AxisModel(name, found, estimate.bic))
    return tuple(sorted(done, key=lambda one: one.bic))
