"""Inverse-dynamics least squares for the upper disc alone (stage 1) or any single axis.

Positions go through a zero-phase Butterworth filter and central differences, and all
columns through one anti-alias filter and decimation, as published for EMPS (Janot, Gautier
and Brunot, 2019).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.identification.coasting import check_coasting
from drill_env.identification.drive import check_axis
from drill_env.identification.inverse_dynamics import (
    ASYMMETRIC,
    SYMMETRIC,
    InverseOptions,
    force_balance,
    relative_error,
)
from drill_env.parameters import Rig
from drill_env.recordings import Recording

_WORST_CONDITION = 1e3


@dataclass(frozen=True, slots=True)
class OneInertiaResult:
    """An identified axis: M a + Fv v + Fc sign(v) + offset = gain u.

    Attributes:
        gain: force or torque per volt, as given.
        asymmetric: whether friction was fitted apart for each direction.
        estimates: by name, in units of force, position and time.
        standard_errors: of the estimates, as if the left-over force were white; it is
            coloured in practice, so the true ones are larger.
        fit_errors: relative force error on each fitted recording, by source, share of 1.
        fit_error: the same on all of them together.
        holdout_errors: the same on each held-out recording, by source.
        condition: condition number of the regressors, columns scaled to equal length.
        samples: rows of the regression.
        options: how the derivatives were taken.
    """

    gain: float
    asymmetric: bool
    estimates: Mapping[str, float]
    standard_errors: Mapping[str, float]
    fit_errors: Mapping[str, float]
    fit_error: float
    holdout_errors: Mapping[str, float]
    condition: float
    samples: int
    options: InverseOptions

    @property
    def rig(self) -> Rig:
        """The one-inertia rig of the estimates: Tsu = Fc, dTsu = offset, bu = Fv.

        Raises:
            InputError: the estimates are no passive axis.
        """
        e = self.estimates
        if self.asymmetric:
            fv, fc = (e["Fv_plus"], e["Fv_minus"]), (e["Fc_plus"], e["Fc_minus"])
        else:
            fv, fc = (e["Fv"], e["Fv"]), (e["Fc"] + e["offset"], e["Fc"] - e["offset"])
        try:
            return Rig.one_inertia(
                km=self.gain, Ju=e["M"], Tsu=0.5 * (fc[0] + fc[1]), dTsu=0.5 * (fc[0] - fc[1]),
                bu=0.5 * (fv[0] + fv[1]), dbu=0.5 * (fv[0] - fv[1]),
            )  # fmt: skip
        except InputError as error:
            raise InputError(
                f"the estimates make no rig ({error}); check the signs of voltage and position "
                "(--map u=COLUMN:-1 turns one round) and that the run moves both ways"
            ) from error

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return asdict(self)


def identify_one_inertia(
    fit: Sequence[Recording],
    gain: float | None,
    *,
    holdout: Sequence[Recording] = (),
    asymmetric: bool = False,
    options: InverseOptions | None = None,
) -> OneInertiaResult:
    """Fit mass, viscous and Coulomb friction and offset by least squares on the force.

    Args:
        fit: recordings with u and theta_u to fit together.
        gain: force or torque per volt, known from elsewhere: recordings show only ratios.
        holdout: recordings to judge by.
        asymmetric: friction apart for each direction.
        options: filter and decimation.

    Raises:
        InputError: the gain is missing, a recording does not fit, or the parameters
            cannot be told apart.
    """
    _check_gain(fit, gain)
    check_axis([*fit, *holdout])
    check_coasting([*fit, *holdout])
    assert gain is not None
    options = options or InverseOptions()
    blocks, held = (
        [force_balance(r, gain, asymmetric, options)[:2] for r in group] for group in (fit, holdout)
    )
    names = ASYMMETRIC if asymmetric else SYMMETRIC
    regressors, force = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    condition = _condition(regressors, names)
    values: FloatArray = np.asarray(np.linalg.lstsq(regressors, force, rcond=None)[0], float)
    errors = _standard_errors(regressors, force - regressors @ values)
    return OneInertiaResult(
        gain=gain, asymmetric=asymmetric, condition=condition, samples=len(force), options=options,
        estimates=dict(zip(names, values.tolist(), strict=True)),
        standard_errors=dict(zip(names, errors.tolist(), strict=True)),
        fit_errors=_errors_of(fit, blocks, values),
        fit_error=relative_error(force, regressors @ values),
        holdout_errors=_errors_of(holdout, held, values),
    )  # fmt: skip


def _check_gain(fit: Sequence[Recording], gain: float | None) -> None:
    if not fit:
        raise InputError("no recording to fit; give at least one")
    if gain is None:
        raise InputError(
            "a recording of one inertia shows only ratios (M/km, Fv/km, Fc/km), so the gain km "
            "must be known: give --gain KM (force or torque per volt) or --gain-column NAME"
        )
    if not (np.isfinite(gain) and gain > 0):
        raise InputError(
            f"gain is {gain}: give a number greater than 0; where voltage and motion have "
            "opposite signs turn one round, --map u=COLUMN:-1"
        )


def _errors_of(
    recordings: Sequence[Recording],
    blocks: Sequence[tuple[FloatArray, FloatArray]],
    values: FloatArray,
) -> dict[str, float]:
    return {
        recording.source: relative_error(force, regressors @ values)
        for recording, (regressors, force) in zip(recordings, blocks, strict=True)
    }


def _condition(regressors: FloatArray, names: Sequence[str]) -> float:
    lengths = np.linalg.norm(regressors, axis=0)
    if np.any(lengths == 0.0):
        name = names[int(np.argmin(lengths))]
        raise InputError(f"{name} cannot be identified: nothing in the recordings excites it")
    condition = float(np.linalg.cond(regressors / lengths))
    if not condition < _WORST_CONDITION:
        raise InputError(
            f"{', '.join(names)} cannot be told apart (condition {condition:.2g}): add a "
            "recording that moves both ways at several speeds"
        )
    return condition


def _standard_errors(regressors: FloatArray, left: FloatArray) -> FloatArray:
    rows, columns = regressors.shape
    variance = float(left @ left) / max(rows - columns, 1)
    return np.sqrt(variance * np.diag(np.linalg.inv(regressors.T @ regressors)))
