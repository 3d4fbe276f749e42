"""Free shapes: functions of one coordinate that stand for physics without a name."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drill_env._types import FloatArray
from drill_env.effects.along import Motion
from drill_env.parameters import Rig
from drill_env.prediction.candidate import Candidate, Kind, Scales

_KNOTS, _TURN_KNOTS = 7, 12
_TURN = 2.0 * np.pi
# Where a function of a speed has its knots, in shares of the fastest.
_SPEEDS = (-1.0, -0.3, -0.05, 0.05, 0.3, 1.0)
_MOST = 5.0

# Component, sort and coordinate of each; which disc's recordings scale it.
_UPPER = (
    ("upper", "torque", "theta_u"), ("upper", "torque", "omega_u"), ("upper", "torque", "time"),
    ("upper", "friction", "theta_u"), ("upper", "friction", "time"),
    ("upper", "damping", "theta_u"), ("upper", "damping", "time"),
    ("actuator", "drive", "voltage"), ("actuator", "drive", "omega_u"),
    ("actuator", "drive", "theta_u"), ("actuator", "drive", "time"),
)  # fmt: skip
_LOWER = (
    ("lower", "torque", "theta_l"), ("lower", "torque", "omega_l"), ("lower", "torque", "time"),
    ("string", "torque", "twist"), ("string", "torque", "omega_u - omega_l"),
)  # fmt: skip


def free_shapes(
    rig: Rig, motions: Sequence[Motion], scales: Sequence[Scales], *, amplifier: bool
) -> list[Candidate]:
    """Piecewise linear functions over what the recordings hold.

    Args:
        rig: how many discs there are.
        motions: of the recordings.
        scales: of each disc.
        amplifier: whether one lies between what was recorded and the motor.
    """
    places = [p for p in _UPPER if amplifier or p[0] != "actuator"]
    found = [_shape(p, motions, scales[0]) for p in places]
    if rig.inertias == 2:
        found += [_shape(p, motions, scales[1]) for p in _LOWER]
    return [shape for shape in found if shape is not None]


def coordinate(motion: Motion, name: str) -> FloatArray:
    """Values of a coordinate at the rows of a motion, shape (n,)."""
    states = motion.states
    values = {
        "time": motion.t, "voltage": motion.u, "theta_u": states[:, 0] + states[:, 3],
        "theta_l": states[:, 3], "twist": states[:, 0], "omega_u": states[:, 1],
        "omega_l": states[:, 2], "omega_u - omega_l": states[:, 1] - states[:, 2],
    }  # fmt: skip
    return values[name]


def _shape(
    place: tuple[str, str, str], motions: Sequence[Motion], scales: Scales
) -> Candidate | None:
    component, sort, name = place
    values = np.concatenate([coordinate(m, name) for m in motions])
    low, high = np.percentile(values, [1.0, 99.0])
    if not high > low:
        return None
    knots = np.linspace(low, high, _KNOTS)
    if "omega" in name and low < 0.0 < high:
        knots = max(-low, high) * np.array(_SPEEDS)
    entry = {"id": "table", "component": component, "depends_on": name, "sort": sort}
    if name.startswith("theta"):
        if high - low < _TURN:
            # A way of less than a turn closes where it never comes.
            entry["period"] = 2.0 * (high - low)
            knots = np.sort(np.mod(knots, entry["period"]))
        else:
            knots = np.linspace(0.0, _TURN, _TURN_KNOTS + 1)[:-1]
    if (np.diff(knots) <= 0.0).any():
        return None
    entry["knots"] = knots.tolist()
    return _made(entry, component, sort, name, scales)


def _made(entry: dict, component: str, sort: str, name: str, scales: Scales) -> Candidate:
    count = len(entry["knots"])
    size = 0.1 if sort == "drive" else 0.1 * scales.torque
    if sort == "damping":
        size /= scales.speed
    kinds: tuple[Kind, ...] = ("linear",) * count
    label = f"{component}_{sort}_of_{name.replace(' - ', '_less_')}"
    return Candidate(
        label, component, name, kinds, ((size,),) * count, np.full(count, -_MOST),
        np.full(count, _MOST), None, entry,
    )  # fmt: skip
