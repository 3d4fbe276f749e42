"""What a residual is learnt from: coordinates of the motion and their past."""

from __future__ import annotations

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.shapes import COORDINATES
from drill_env.effects.along import Motion
from drill_env.recordings.signals import lagged

_HARMONICS = (1, 2)
# First-order lags (s) of what may be remembered, and whether of its size.
_LAGS: tuple[tuple[str, bool, float], ...] = (
    ("voltage", False, 0.1), ("voltage", False, 1.0), ("voltage", True, 5.0),
    ("omega_l", False, 0.3), ("omega_l", False, 3.0), ("omega_l", True, 10.0),
    ("omega_u", False, 0.3), ("twist", False, 0.3),
)  # fmt: skip
# Widths of play, in shares of the voltage's range, by which a drive may remember where it turned:
# even in the logarithm, not derived; trees interpolate between them.
_WIDTHS = (0.03, 0.1, 0.3)

# Lags (s) of a linear memory, from what few samples resolve to half of a short recording. With two
# a decade a law whose lag lies between is a combination of both.
_MEMORY = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)


def features_of(name: str, motion: Motion) -> FloatArray:
    """What is learnt from of one coordinate: itself, where in its turn it is, and its past.

    Args:
        name: of the coordinate.
        motion: how the rig moved.
    """
    values = COORDINATES[name](motion)
    columns = [values]
    if name.startswith("theta"):
        columns += [wave(order * values) for order in _HARMONICS for wave in (np.sin, np.cos)]
    for other, sizes, constant in _LAGS:
        if other == name:
            columns.append(_lagged(motion, np.abs(values) if sizes else values, constant))
    if name == "voltage":
        columns += [_beyond_play(values, share * float(np.ptp(values))) for share in _WIDTHS]
    return np.column_stack(columns)


def memory_of(motion: Motion, *, sizes: bool) -> FloatArray:
    """The voltage and what first-order lags of many times keep of it.

    Linear combinations of these are what a linear rig and any linear law with a memory make of the
    drive: a filter, a damper on rubber, a mass on a spring. Speeds are left out, whose fast past
    tells the acceleration: whatever torque acts, noise too, accelerates the disc.

    Args:
        motion: how the rig moved.
        sizes: whether also of its size.
    """
    values = [motion.u, np.abs(motion.u)] if sizes else [motion.u]
    return np.column_stack(
        [x for one in values for x in (one, *(_lagged(motion, one, lag) for lag in _MEMORY))]
    )


def _beyond_play(values: FloatArray, width: float) -> FloatArray:
    """How far values are from what follows them with play, the operator of Prandtl (1928).

    It tells from which side they came, however long ago that was.
    """
    out, there = np.empty(len(values)), float(values[0])
    for i, value in enumerate(values.tolist()):
        there = min(max(there, value - width), value + width)
        out[i] = value - there
    return out


def _lagged(motion: Motion, values: FloatArray, constant: float) -> FloatArray:
    """Values behind a first-order lag (s), at rest at its first value after each restart."""
    samples = constant / float(np.median(np.diff(motion.t)))
    ends = [*motion.restarts[1:].tolist(), len(values)]
    out = np.empty(len(values))
    for a, b in zip(motion.restarts.tolist(), ends, strict=True):
        out[a:b] = values[a] + lagged(values[a:b] - values[a], samples)
    return out
