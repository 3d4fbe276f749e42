"""Force balance of one inertia along a recording: filter, differentiate, decimate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.identification.known_loads import force_on_axis, known_force
from drill_env.parameters import Rig
from drill_env.recordings import Recording

SYMMETRIC = ("M", "Fv", "Fc", "offset")
ASYMMETRIC = ("M", "Fv_plus", "Fv_minus", "Fc_plus", "Fc_minus")

# MATLAB's decimate: order, ripple in dB and cut-off as a share of the new Nyquist frequency.
_DECIMATE_ORDER, _RIPPLE, _SHARE = 8, 0.05, 0.8


@dataclass(frozen=True, slots=True)
class InverseOptions:
    """How velocities and accelerations are taken from positions.

    The defaults are the published EMPS procedure at 1 kHz and scale with the rate.

    Args:
        cutoff: cut-off of the zero-phase Butterworth filter in Hz; 100 Hz or a tenth of
            the sampling rate by default, whichever is lower.
        order: order of that filter.
        decimation: every how manieth sample is kept after MATLAB's anti-alias filter;
            rate / cutoff by default.
        lead: samples dropped at the start, 5 rate / cutoff - 1 by default (49).
        trail: samples dropped at the end, none by default.
        centre_hold: take the force at t[i] as the mean of the voltages held before and
            after it. That is right for a held voltage, and the slower the sampling the
            more it matters, but the published procedure does without.
    """

    cutoff: float | None = None
    order: int = 4
    decimation: int | None = None
    lead: int | None = None
    trail: int = 0
    centre_hold: bool = False


def force_balance(
    recording: Recording, gain: float, asymmetric: bool, options: InverseOptions
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Regressors and force of M a + friction = gain u + what is known, for the recording's theta_u.

    Args:
        recording: with u and theta_u and no gaps.
        gain: force per volt.
        asymmetric: friction apart for each direction.
        options: filter and decimation.

    Returns:
        Regressors, shape (k, 4) or (k, 5), columns as in `SYMMETRIC` or `ASYMMETRIC`;
        force, shape (k,); times in s, shape (k,).

    Raises:
        InputError: a channel is missing, the recording has gaps, or the options do not fit.
    """
    from scipy import signal

    force, position = force_on_axis(recording, gain), recording.channel("theta_u")
    if options.centre_hold:
        force = np.append(force[0], 0.5 * (force[1:] + force[:-1]))
    if recording.has_note("gap"):
        raise InputError(
            f"{recording.source}: the time has gaps, and derivatives across them are wrong; "
            "cut the recording at the gaps"
        )
    cutoff, decimation, lead = _settled(recording, options)
    b, a = signal.butter(options.order, cutoff / (0.5 * recording.rate))
    # The published figures were made with MATLAB's filtfilt, which pads by 3 x order.
    smooth = signal.filtfilt(b, a, position, padlen=3 * options.order)
    velocity = np.gradient(smooth, recording.interval)
    acceleration = np.gradient(velocity, recording.interval)
    if recording.added_inertia_u or recording.effects:
        force = force + known_force(recording, gain, (smooth, velocity, acceleration))
    kept = slice(lead, len(recording) - options.trail)
    columns = _regressors(velocity, acceleration, asymmetric)
    regressors = np.stack([_decimate(c[kept], decimation) for c in columns], axis=1)
    force = _decimate(force[kept], decimation)
    return regressors, force, recording.t[kept][_phase(len(columns[0][kept]), decimation)]


def _regressors(v: FloatArray, a: FloatArray, asymmetric: bool) -> list[FloatArray]:
    if not asymmetric:
        return [a, v, np.sign(v), np.ones_like(v)]
    forth, back = (v > 0).astype(float), (v < 0).astype(float)
    return [a, forth * v, back * v, forth, -back]


def _settled(recording: Recording, options: InverseOptions) -> tuple[float, int, int]:
    rate, source = recording.rate, recording.source
    cutoff = min(100.0, 0.1 * rate) if options.cutoff is None else options.cutoff
    if not 0 < cutoff < 0.5 * rate:
        raise InputError(
            f"cutoff is {cutoff:g} Hz: {source} is sampled at {rate:.6g} Hz, give a value "
            f"between 0 and {0.5 * rate:.6g}"
        )
    ratio = rate / cutoff
    decimation = max(1, round(ratio)) if options.decimation is None else options.decimation
    lead = max(0, round(5 * ratio) - 1) if options.lead is None else options.lead
    if decimation < 1 or options.order < 1 or lead < 0 or options.trail < 0:
        raise InputError("decimation and order must be 1 or more, lead and trail 0 or more")
    left = len(recording) - lead - options.trail
    if left < max(10 * decimation, 30):
        raise InputError(
            f"{source}: {len(recording)} rows are too few for cutoff {cutoff:g} Hz and "
            f"decimation {decimation}; give a longer recording or a smaller decimation"
        )
    return cutoff, decimation, lead


def _phase(rows: int, decimation: int) -> slice:
    """The samples MATLAB's decimate keeps: the last one always, the first where it fits."""
    return slice(decimation - 1 - (-rows) % decimation, None, decimation)


def _decimate(values: FloatArray, decimation: int) -> FloatArray:
    from scipy import signal

    if decimation == 1:
        return values
    sections = signal.cheby1(_DECIMATE_ORDER, _RIPPLE, _SHARE / decimation, output="sos")
    padding = min(3 * _DECIMATE_ORDER, len(values) - 1)
    smooth = signal.sosfiltfilt(sections, values, padlen=padding)
    return smooth[_phase(len(values), decimation)]


def relative_error(force: FloatArray, predicted: FloatArray) -> float:
    """Norm of the left-over force over the norm of the force."""
    return float(np.linalg.norm(force - predicted) / np.linalg.norm(force))


def rig_force_error(recording: Recording, rig: Rig, options: InverseOptions | None = None) -> float:
    """Relative force error of a one-inertia rig on a recording, as a share of 1.

    Raises:
        InputError: the rig has two inertias, or the recording does not fit.
    """
    if rig.inertias != 1:
        raise InputError("the force error needs a one-inertia rig (inertias = 1 in its file)")
    regressors, force, _ = force_balance(recording, rig.km, True, options or InverseOptions())
    values = (
        rig.Ju, rig.bu + rig.dbu, rig.bu - rig.dbu, rig.Tsu + rig.dTsu, rig.Tsu - rig.dTsu
    )  # fmt: skip
    return relative_error(force, regressors @ np.array(values))
