"""The effects that a rig declares, checked and laid out for the compiled code."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.effects import LIBRARY, Effect
from drill_env.effects._bundle import TABLE, Bundle
from drill_env.effects._signal import MEMORY
from drill_env.effects._table import ACTIONS, COORDINATES
from drill_env.parameters import Rig

WIDTH = 8
"""Most parameters of an effect."""

_TABLE_KEYS = {"id", "component", "depends_on", "sort", "knots", "values", "encoder", "period"}
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


def declared(rig: Rig) -> Bundle:
    """The rig's effects as the compiled code reads them.

    Raises:
        InputError: an effect is unknown, a parameter is missing, unknown or out of range, or
            the rig has no such component.
    """
    rows = []
    for place, entry in enumerate(rig.effects):
        try:
            rows.append(_row(entry, rig))
        except InputError as error:
            raise InputError(f"rig effect {place + 1}: {error}") from error
    rows.sort(key=lambda row: row[0])
    longest = max((row[5].shape[1] for row in rows), default=0)
    tables = np.zeros((len(rows), 2, longest))
    for i, row in enumerate(rows):
        tables[i, :, : row[5].shape[1]] = row[5]
    return Bundle(
        np.array([row[1] for row in rows], dtype=np.int64),
        np.array([row[2] for row in rows], dtype=np.int64),
        np.array([row[3] for row in rows], dtype=np.int64),
        np.array([row[4] for row in rows]).reshape(len(rows), WIDTH),
        tables,
    )


def bundled(effects: Sequence[tuple[Effect, FloatArray]]) -> Bundle:
    """Effects with their numbers as the compiled code reads them."""
    q = np.zeros((len(effects), WIDTH))
    for i, (_, numbers) in enumerate(effects):
        q[i, : len(numbers)] = numbers
    return Bundle(
        np.array([effect.code for effect, _ in effects], dtype=np.int64),
        np.array([effect.senses for effect, _ in effects], dtype=np.int64),
        np.array([effect.equation == "upper" for effect, _ in effects], dtype=np.int64), q,
        np.zeros((len(effects), 2, 0)),
    )  # fmt: skip


def new_memories(bundle: Bundle) -> FloatArray:
    """What the effects remember, at the start; shape (effects, MEMORY)."""
    return np.zeros((len(bundle.codes), MEMORY))


def longest_hold(rig: Rig) -> float:
    """Time (s) for which torques may be held at most: a drive's ringing needs resolving."""
    longest = math.inf
    for entry in rig.effects:
        effect = LIBRARY.get(str(entry.get("id")))
        if effect is not None and effect.replaces_balance:
            share = float(entry["motor_share"])
            # Of the lighter of the two, alone on the spring.
            fastest = 2.0 * math.pi * float(entry["frequency"]) * math.sqrt(max(share, 1.0 - share))
            longest = min(longest, 0.5 / fastest)
    return longest


_Row = tuple[int, int, bool, bool, FloatArray, FloatArray]


def _row(entry: Mapping[str, Any], rig: Rig) -> _Row:
    """Rank, code, whether it senses and is the upper disc's alone, parameters and table."""
    name = entry.get("id")
    if name == "table":
        return _table_row(entry, rig)
    effect = LIBRARY.get(name) if isinstance(name, str) else None
    if effect is None:
        raise InputError(f"id is {name!r}; known: {', '.join([*LIBRARY, 'table'])}")
    _check_component(effect.id, effect.equation, rig)
    values = {key: value for key, value in entry.items() if key != "id"}
    for key, value in values.items():
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise InputError(f"effect {name}: {key} is {value!r}; give a number")
    q = np.zeros(WIDTH)
    vector = effect.vector(values)
    q[: len(vector)] = vector
    rank = 0 if effect.replaces_balance else 2 if effect.friction else 1
    return rank, effect.code, effect.senses, effect.equation == "upper", q, np.zeros((2, 0))


def _check_component(name: str, equation: str, rig: Rig) -> None:
    if rig.inertias == 1 and equation != "upper":
        raise InputError(
            f"effect {name} acts on the string or the lower disc, which a rig with "
            "inertias = 1 lacks; remove it"
        )


def _table_row(entry: Mapping[str, Any], rig: Rig) -> _Row:
    unknown = sorted(set(entry) - _TABLE_KEYS)
    if unknown:
        known = ", ".join(sorted(_TABLE_KEYS))
        raise InputError(f"table: unknown key {unknown[0]}; known: {known}")
    coordinate = entry.get("depends_on")
    if coordinate not in COORDINATES:
        raise InputError(
            f"table: depends_on is {coordinate!r}; give one of {', '.join(COORDINATES)}"
        )
    action = _action(entry)
    _check_component("table", "upper" if action.endswith("_u") else "lower", rig)
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
        table = _closed(table, period)
    q = np.zeros(WIDTH)
    q[:4] = COORDINATES.index(coordinate), ACTIONS.index(action), table.shape[1], period
    rank = 2 if action.startswith("friction") else 1
    return rank, TABLE, action.startswith("angle"), action.endswith("_u"), q, table


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
    if isinstance(given, str) or not isinstance(given, Sequence):
        raise InputError(f"table: {key} is {given!r}; give a list of numbers")
    plain = all(issubclass(t, (int, float)) and t is not bool for t in set(map(type, given)))
    if not plain or not np.isfinite(np.array(given, dtype=float)).all():
        raise InputError(f"table: {key} holds something that is no finite number; correct it")
    return np.array(given, dtype=float)


def _period(entry: Mapping[str, Any], coordinate: str) -> float:
    """Way along its coordinate after which a table begins again; 0 for never."""
    given = entry.get("period", _TURN if coordinate.startswith("theta") else None)
    if given is None:
        return 0.0
    if isinstance(given, bool) or not isinstance(given, (int, float)) or not 0 < given < math.inf:
        raise InputError(f"table: period is {given!r}; give a number greater than 0")
    return float(given)


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
