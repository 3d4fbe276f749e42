"""A measured curve that a rig declares, checked and laid out for the compiled code."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from drill_env._checks import real
from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.effects._table import ACTIONS, COORDINATES, sampled, tabulated
from drill_env.effects.signal import ENTRY

_TABLE_KEYS = {
    "id", "component", "depends_on", "sort", "knots", "values", "encoder", "period", "located",
}  # fmt: skip
_ACTION = {
    ("actuator", "torque"): "torque_u",
    ("upper", "torque"): "torque_u",
    ("lower", "torque"): "torque_l",
    ("string", "torque"): "string",
    ("upper", "friction"): "friction_u",
    ("lower", "friction"): "friction_l",
    ("actuator", "drive"): "drive_u",
    ("upper", "drive"): "drive_u",
    ("upper", "damping"): "damping_u",
    ("string", "damping"): "damping",
    ("string", "stiffness"): "stiffness",
}
_TURN = 2.0 * math.pi
_ENCODER = {"theta_u": "upper", "theta_l": "lower"}


def table_entry(entry: Mapping[str, Any]) -> tuple[np.ndarray, FloatArray]:
    """A record of `ENTRY`, and the table it points to, which must live as long.

    Raises:
        InputError: a key, the coordinate, the knots or the period are wrong.
    """
    unknown = sorted(str(key) for key in set(entry) - _TABLE_KEYS)
    if unknown:
        known = ", ".join(sorted(_TABLE_KEYS))
        raise InputError(f"table: unknown key {unknown[0]}; known: {known}")
    coordinate = entry.get("depends_on")
    if not isinstance(coordinate, str) or coordinate not in COORDINATES:
        raise InputError(
            f"table: depends_on is {coordinate!r}; give one of {', '.join(COORDINATES)}"
        )
    action = _action(entry)
    knots = _numbers(entry, "knots")
    values = _numbers(entry, "values")
    if len(knots) < 2 or len(knots) != len(values) or (np.diff(knots) <= 0).any():
        raise InputError(
            f"table: {len(knots)} knots and {len(values)} values; give two or more ascending "
            "knots and as many values"
        )
    table = np.array([knots, values])
    period = _period(entry, coordinate)
    if period > 0.0:
        table = np.ascontiguousarray(_closed(table, period))
    row = np.zeros((), dtype=ENTRY)
    located = is_located(entry)
    row["code"] = (tabulated if located else sampled).address
    row["table"], row["switches"] = table.ctypes.data, int(located)
    row["senses"] = row["idle"] = action.startswith("angle")
    row["upper"], row["timed"] = action.endswith("_u"), coordinate == "time"
    row["q"][:4] = COORDINATES.index(coordinate), ACTIONS.index(action), table.shape[1], period
    return row, table


def is_located(entry: Mapping[str, Any]) -> bool:
    """Whether steps end at the knots of a table.

    Raises:
        InputError: it is neither true nor false.
    """
    located = entry.get("located", True)
    if not isinstance(located, bool):
        raise InputError(f"table: located is {located!r}; give true or false")
    return located


def _action(entry: Mapping[str, Any]) -> str:
    component, sort = str(entry.get("component")), str(entry.get("sort"))
    if sort == "error":
        encoder = entry.get("encoder", _ENCODER.get(str(entry.get("depends_on"))))
        if encoder not in ("upper", "lower"):
            raise InputError(f'table: encoder is {encoder!r}; give "upper" or "lower"')
        return "angle_u" if encoder == "upper" else "angle_l"
    if "encoder" in entry:
        raise InputError('table: encoder goes with sort = "error" only; remove it')
    if (component, sort) not in _ACTION:
        raise InputError(
            f"table: component {component!r} with sort {sort!r}; give sort torque with actuator, "
            "upper, string or lower, friction with upper or lower, drive with actuator or upper, "
            "damping with upper or string, stiffness with string, or error with sensor"
        )
    return _ACTION[component, sort]


def _numbers(entry: Mapping[str, Any], key: str) -> FloatArray:
    given = entry.get(key)
    if isinstance(given, np.ndarray) and given.ndim == 1 and np.isfinite(given).all():
        # Samples of a recording by the ten thousand, which were checked when it was read.
        return given.astype(float)
    if isinstance(given, str) or not isinstance(given, Sequence):
        raise InputError(f"table: {key} is {given!r}; give a list of numbers")
    return np.array([real(number, f"table: a number of {key}") for number in given], dtype=float)


def _period(entry: Mapping[str, Any], coordinate: str) -> float:
    """Way along its coordinate after which a table begins again; 0 for never."""
    given = entry.get("period", _TURN if coordinate.startswith("theta") else None)
    if given is None:
        return 0.0
    period = real(given, "table: period")
    if not period > 0:
        raise InputError(f"table: period is {period}; give a number greater than 0")
    return period


def _closed(table: FloatArray, period: float) -> FloatArray:
    """A table that comes back, with knots at 0 and at the whole period."""
    knots, values = table
    if knots[0] < 0.0 or knots[-1] > period + 1e-9:
        raise InputError(
            f"table: knots lie outside 0 to {'2 pi' if period == _TURN else f'{period:g}'}, the "
            "period; shift them by periods"
        )
    if knots[-1] - knots[0] >= period - 1e-9:
        return table
    ends = np.interp([0.0], knots, values, period=period)
    inner = (knots > 0.0) & (knots < period)
    return np.vstack(
        [
            np.concatenate([[0.0], knots[inner], [period]]),
            np.concatenate([ends, values[inner], ends]),
        ]
    )
