"""What tracing a branch of limit cycles asks along it, whatever the flow."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drill_env._types import FloatArray
from drill_env.continuation.branch import Point
from drill_env.continuation.tracer import VANISHED, CycleBranch

# A settled motion is known at its samples only.
_ALIKE = 0.05
SHRANK = "shrank to an equilibrium"
"""How the end of a branch begins that has no amplitude left."""


def typical_sizes(z: FloatArray) -> FloatArray:
    """Scales of (twist, omega_u, omega_l, ..., period, parameter) at a cycle, shape (n,)."""
    size = max(1.0, abs(float(z[2])))
    scale = size + 4.0 + np.abs(z)
    scale[0], scale[2], scale[-2], scale[-1] = 0.5 * size + 1.0, size + 9.0, z[-2], 1.0
    return scale


def known(branches: Sequence[CycleBranch], z: FloatArray) -> bool:
    """Whether a cycle lies on one of the branches."""
    for branch in branches:
        values = np.array([p.cycle.parameter for p in branch.points])
        peaks = np.array([p.cycle.max for p in branch.points])
        for i in np.flatnonzero((values[:-1] - z[-1]) * (values[1:] - z[-1]) <= 0.0).tolist():
            order = i + np.argsort(values[i : i + 2])
            peak = np.interp(z[-1], values[order], peaks[order])
            if abs(peak - z[2]) < _ALIKE * (1.0 + abs(z[2])):
                return True
    return False


def ended(point: Point, low: float, high: float) -> str:
    """Why a branch within a range ends at a point, or ""."""
    value, cycle = float(point.z[-1]), point.cycle
    if not low <= value <= high:
        return f"left the range at {low if value < low else high:.6g}"
    if cycle.max - cycle.min < VANISHED * max(abs(cycle.max), 0.1):
        return f"{SHRANK} at {value:.6g}"
    return ""
