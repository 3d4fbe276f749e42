"""The friction laws compared on the same recordings, and what each can make the rig do."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FrictionLaw
from drill_env.identification.coordinates import active_names
from drill_env.identification.drive import motion_driven
from drill_env.identification.estimate import Estimate, FitOptions
from drill_env.identification.law_starts import fit_from, law_starts, top_speed
from drill_env.identification.stick_free import StickFree, soft_share, stick_free
from drill_env.identification.validation import Validation, validate_estimate
from drill_env.parameters import Rig
from drill_env.parameters.rig import LOWER_LAW
from drill_env.recordings import Channel, Recording

LawProgress: TypeAlias = Callable[[FrictionLaw, int, float], None]
"""Called with law, iteration and minus twice the log likelihood."""

_Found: TypeAlias = dict[FrictionLaw, tuple[Estimate, tuple[float, ...]]]
_LAWS: tuple[FrictionLaw, ...] = ("humped", "coulomb", "stribeck")
_LOWER = frozenset(LOWER_LAW)


@dataclass(frozen=True, slots=True, eq=False)
class LawFit:
    """One law on the recordings.

    Attributes:
        law: its name.
        estimate: the best of its fits.
        starts: minus twice the log posterior that each start reached.
        validations: of the recordings that the laws are judged by.
        vibration: what constant voltages can make of the fitted rig; None where the fit leaves
            it no steady motion.
        soft: share of the posterior in which steady turning gives way to stable vibration.
        remark: why `vibration` is missing, or empty.
    """

    law: FrictionLaw
    estimate: Estimate
    starts: tuple[float, ...]
    validations: tuple[Validation, ...]
    vibration: StickFree | None
    soft: float
    remark: str

    def error(self, channel: Channel, *, free_run: bool) -> float:
        """Root mean square error over all recordings, rad; NaN where it was not recorded."""
        results = [v.replay for v in self.validations]
        parts = [r.errors if free_run else r.prediction_errors for r in results]
        squares = [part[channel].rms ** 2 for part in parts if channel in part]
        return math.sqrt(sum(squares) / len(squares)) if squares else math.nan

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        channels: set[Channel] = {name for v in self.validations for name in v.replay.errors}
        return {
            "law": self.law,
            "parameters": {
                n: getattr(self.estimate.rig, n) for n in sorted(active_names(self.estimate.rig))
            },
            "free": len(self.estimate.free),
            "bic": self.estimate.bic,
            "converged": self.estimate.converged,
            "start_values": list(self.starts),
            "free_run_rms": {n: self.error(n, free_run=True) for n in sorted(channels)},
            "prediction_rms": {n: self.error(n, free_run=False) for n in sorted(channels)},
            "vibration": self.vibration.as_dict() if self.vibration else None,
            "soft_share": self.soft if math.isfinite(self.soft) else None,
            "remark": self.remark,
        }


@dataclass(frozen=True, slots=True, eq=False)
class LawComparison:
    """All laws on the same recordings.

    Attributes:
        fits: by rising information criterion.
        held_out: whether the errors are of recordings that were not fitted.
        to_volts: highest constant voltage searched for vibration, V.
    """

    fits: tuple[LawFit, ...]
    held_out: bool
    to_volts: float

    def fit(self, law: FrictionLaw) -> LawFit:
        """The fit of one law."""
        return next(fit for fit in self.fits if fit.law == law)

    def gap(self, law: FrictionLaw) -> float:
        """By how much the information criterion of a law exceeds the lowest one."""
        return self.fit(law).estimate.bic - self.fits[0].estimate.bic

    @property
    def conclusion(self) -> str:
        """What the comparison says, one sentence a law."""
        return " ".join(self._sentence(fit) for fit in self.fits)

    def _sentence(self, fit: LawFit) -> str:
        gap = self.gap(fit.law)
        rank = "has the lowest BIC" if gap <= 0 else f"has a BIC {gap:.0f} higher"
        if fit.vibration is None:
            return f"The {fit.law} law {rank}; {fit.remark}."
        if fit.vibration.exists and fit.vibration.volts:
            low, high = fit.vibration.volts
            can = f"makes stick-free vibration (from {low:.2f} to {high:.2f} V)"
        elif fit.vibration.exists:
            can = "makes stick-free vibration"
        elif any(motion == "stopping" for _, motion in fit.vibration.simulated):
            can = "makes vibration only with standstill or reversal of the lower disc"
        else:
            can = f"makes no lasting vibration up to {self.to_volts:.3g} V"
        return f"The {fit.law} law {rank} and {can}."

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "laws": [{**fit.as_dict(), "bic_gap": self.gap(fit.law)} for fit in self.fits],
            "held_out": self.held_out,
            "to_volts": self.to_volts,
            "conclusion": self.conclusion,
        }


def compare_laws(
    recordings: Sequence[Recording],
    rig: Rig,
    *,
    fixed: Mapping[str, float] | None = None,
    holdout: Sequence[Recording] = (),
    options: FitOptions | None = None,
    progress: LawProgress | None = None,
) -> LawComparison:
    """Fit the Coulomb, Stribeck and humped law to the same recordings.

    The rig's own law is fitted first; the others start from the likeliest of several curves near
    its fitted one, the Stribeck law also from the Coulomb fit that it contains. Each law's noise
    is its own, so that a law pays for what it leaves to noise.

    Args:
        recordings: to fit, with u and both angles.
        rig: where to start; of any law.
        fixed: parameters given; those of the lower law apply to the rig's own law only.
        holdout: recordings to judge by; those of the fit where there are none.
        options: how to fit.
        progress: see `LawProgress`.

    Raises:
        InputError: an argument is out of range, or the rig has one inertia.
    """
    if rig.inertias == 1:
        raise InputError(
            "the laws compared are those of the lower disc: give a rig with 2 inertias"
        )
    if motion_driven(recordings):
        raise InputError(
            f"{recordings[0].source}: the laws are compared by what a voltage does with them, and "
            "with u=unknown there is none: fit each law by a rig file of its own and compare bic"
        )
    fixed = dict(fixed or {})
    top = top_speed(recordings)
    volts = max(float(np.abs(r.channel("u")).max()) for r in recordings)
    found: _Found = {}
    order: list[FrictionLaw] = sorted(
        _LAWS, key=lambda law: (law != rig.friction, _LAWS.index(law))
    )
    for law in order:
        known = {n: v for n, v in fixed.items() if law == rig.friction or n not in _LOWER}
        first = next(iter(found.values()))[0].rig if found else rig
        plain = found["coulomb"][0].rig if "coulomb" in found else None
        report = partial(progress, law) if progress else None
        estimates = [
            fit_from(
                recordings, start, known, options or FitOptions(), report, warm=law != order[0]
            )
            for start in law_starts(law, first, plain, recordings[0], top)
        ]
        best = min(estimates, key=lambda e: e.point.value)
        found[law] = (best, tuple(e.point.value for e in estimates))
    fits = [_judged(law, *found[law], recordings, holdout, volts) for law in found]
    return LawComparison(
        tuple(sorted(fits, key=lambda fit: fit.estimate.bic)), bool(holdout), volts
    )


def _judged(
    law: FrictionLaw, estimate: Estimate, starts: tuple[float, ...],
    recordings: Sequence[Recording], holdout: Sequence[Recording], volts: float,
) -> LawFit:  # fmt: skip
    validations = validate_estimate(estimate, holdout)
    judged = validations[len(recordings) :] if holdout else validations
    vibration, soft, remark = None, math.nan, ""
    try:
        vibration = stick_free(estimate.rig, volts)
        soft = soft_share(estimate, volts)
    except InputError as error:
        remark = str(error)
    return LawFit(law, estimate, starts, tuple(judged), vibration, soft, remark)
