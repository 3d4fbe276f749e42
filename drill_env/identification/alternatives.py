"""Whether a recording that does not fit the rig does so with its columns read otherwise."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np

from drill_env._types import FloatArray
from drill_env.identification.equation_error import (
    Smoothed,
    fit_lower,
    fit_upper,
    grid_step,
    is_varied,
    smoothed,
)
from drill_env.parameters import Rig
from drill_env.recordings import Recording, RecordingWarning

_COLUMNS = ("u", "theta_u", "theta_l")
_CLOCKS = {1e-3: "ms", 1e-6: "us", 60.0: "min", 1e3: "ks"}
_USUAL_RATES = (15.0, 1100.0)
_FASTEST_COLUMN = 60.0
_ALIKE = 2.2


def find_alternative(recording: Recording) -> RecordingWarning | None:
    """Name swapped columns, velocities for angles or a wrong clock; None if nothing fits better.

    Args:
        recording: with u, theta_u and theta_l.
    """
    if any(getattr(recording, name) is None for name in _COLUMNS):
        return None
    s = smoothed(recording)
    if s is not None and _is_rig(s):
        return None
    return _clock(recording) or _velocities(recording, s) or _swapped(recording)


def _is_rig(s: Smoothed | None) -> bool:
    """Whether both equations explain the motion, all signs are right and the motor drives."""
    if s is None or not is_varied(s.u):
        return False
    upper, lower = fit_upper(s), fit_lower(s)
    if upper is None or lower is None or upper.share < 0.9 or lower.share < 0.7:
        return False
    signs = (upper.drive.sign, upper.damping.sign, lower.hold.sign, lower.pull.sign)
    if signs != (1, 1, 1, 1) or lower.hold.value < upper.hold.value:
        return False
    alike = abs(math.log(lower.pull.value / lower.hold.value)) < math.log(1.25)
    return alike and upper.driven > 0.6


def _swapped(recording: Recording) -> RecordingWarning | None:
    values = [recording.u, recording.theta_u, recording.theta_l]
    for order in list(itertools.permutations(range(3)))[1:]:
        u, theta_u, theta_l = (values[j] for j in order)
        # Exchanged encoders alone are named by the fits themselves.
        if order[0] == 0 or not _is_rig(
            smoothed(replace(recording, u=u, theta_u=theta_u, theta_l=theta_l))
        ):
            continue
        pairs = [(_COLUMNS[i], _COLUMNS[j]) for i, j in enumerate(order) if i != j]
        maps = " ".join(f"--map {channel}={column}" for channel, column in pairs)
        text = f"{recording.source}: the columns are swapped; the rig fits them with {maps}"
        return RecordingWarning("swapped_columns", text)
    return None


def _velocities(recording: Recording, s: Smoothed | None) -> RecordingWarning | None:
    if s is None or float(np.ptp(s.theta)) > _FASTEST_COLUMN:
        return None
    angles = np.cumsum(s.theta, axis=1) * grid_step(recording)
    if not _is_rig(Smoothed(s.u, angles, s.theta, s.omega, np.zeros(2))):
        return None
    text = (
        f"{recording.source}: theta_u and theta_l fit the rig as velocities, not as angles; map "
        "them as such (--map omega_u=COLUMN --map omega_l=COLUMN), or map the encoder angles"
    )
    return RecordingWarning("velocity", text)


def _clock(recording: Recording) -> RecordingWarning | None:
    low, high = _USUAL_RATES
    if low < recording.rate < high:
        return None
    for factor, unit in _CLOCKS.items():
        if low < recording.rate / factor < 4.0 * high:
            s = smoothed(replace(recording, t=recording.t * factor))
            if s is not None and _is_paper_like(s):
                text = (
                    f"{recording.source}: the motion fits the rig with the clock in {unit}: "
                    f"--map t=t:{factor:g}"
                )
                return RecordingWarning("clock", text)
    return None


def _is_paper_like(s: Smoothed) -> bool:
    lower, paper = fit_lower(s), Rig.paper()
    if lower is None or lower.share < 0.7 or lower.hold.sign <= 0:
        return False
    return abs(math.log(lower.hold.value * paper.Jl / paper.ktheta)) < 2.0 * math.log(_ALIKE)


def explained(s: Smoothed | None) -> tuple[float, int]:
    """Share of the upper disc's acceleration that is explained, and the sign of the drive."""
    fit = None if s is None else fit_upper(s)
    return (0.0, 0) if fit is None else (fit.share, fit.drive.sign)


def angle_or_none(values: FloatArray | None) -> FloatArray | None:
    """An angle that moves, else None: a dead encoder tells nothing of its disc."""
    if values is None:
        return None
    finite = values[np.isfinite(values)]
    return values if len(finite) and np.ptp(finite) > 0 else None
