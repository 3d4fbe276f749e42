"""Checks of what drives the rig: the motor's voltage or its torque."""

from __future__ import annotations

import numpy as np

from drill_env._types import FloatArray
from drill_env.recordings.checks import Place
from drill_env.recordings.recording import RecordingWarning

_LARGEST_VOLTAGE = 60.0


def check_voltage(u: FloatArray, place: Place) -> list[RecordingWarning]:
    """Remark a constant, clipped or implausibly large voltage (V), shape (n,)."""
    notes = []
    if np.abs(u).max() > _LARGEST_VOLTAGE and not place.column.stated:
        notes.append(
            RecordingWarning(
                "large_voltage",
                f"{place} reaches {np.abs(u).max():.4g} V; if it is in mV state so: "
                f"{place.mapped('mV')}",
            )
        )
    return notes + _drive(u, place, "V", "voltage")


def check_torque(torque: FloatArray, place: Place) -> list[RecordingWarning]:
    """Remark a constant or clipped motor torque (Nm, or N of a linear axis), shape (n,)."""
    return _drive(torque, place, "Nm", "torque")


def _drive(u: FloatArray, place: Place, unit: str, what: str) -> list[RecordingWarning]:
    if np.all(u == u[0]):
        return [
            RecordingWarning(
                "constant", f"{place} is constant at {u[0]:.6g} {unit}; fine only for a steady run"
            )
        ]
    notes = []
    for name, level in (("maximum", u.max()), ("minimum", u.min())):
        share = clipped_share(u, float(level))
        if share > 0:
            notes.append(
                RecordingWarning(
                    "saturated",
                    f"{place} sits at its {name} {level:.6g} {unit} for {100 * share:.1f} % of the "
                    f"time; if a limit cut it there, record the {what} behind that limit",
                )
            )
    return notes


def clipped_share(u: FloatArray, level: float) -> float:
    """Share of samples cut off at an extreme, 0 when it looks like a peak or a set level."""
    span = float(np.ptp(u))
    depth = np.abs(u - level) / span
    at_level = depth <= 0.0025
    # A smooth signal that was cut is dense at the limit and thin just inside; a peak is not.
    inside = int(((depth > 0.0025) & (depth <= 0.0225)).sum())
    share = float(at_level.mean())
    if share < 0.01 or at_level.sum() < 3 * inside or len(np.unique(u)) < 20:
        return 0.0
    starts = np.flatnonzero(np.diff(at_level.astype(int)) == 1)
    ends = np.flatnonzero(np.diff(at_level.astype(int)) == -1) + 1
    if len(starts) == 0 or len(ends) == 0:
        return 0.0
    # Steps to a set level jump; ramps that stop at one do so once.
    smooth = np.median(depth[np.concatenate([starts, ends])]) < 0.1
    return share if smooth and len(starts) >= 2 else 0.0
