"""Effects that are functions of the voltage and the rig's state alone, on turning discs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from drill_env._types import FloatArray
from drill_env.effects import LIBRARY
from drill_env.effects._signal import RESPONSE, SIGNAL
from drill_env.effects._steady import torques_at
from drill_env.effects.declared import declared, new_memories
from drill_env.friction import kernel_record
from drill_env.parameters import Rig

_STEADY_TABLES = ("voltage", "twist", "omega_u", "omega_l", "omega_u - omega_l")


def acting(rig: Rig) -> Rig:
    """The rig without the effects that only its encoders show."""
    return rig.replace(effects=tuple(e for e in rig.effects if not _senses(e)))


def unsteady(rig: Rig) -> list[str]:
    """Ids of the effects that act on the motion and remember, or follow time or an angle."""
    return [str(e.get("id")) for e in acting(rig).effects if not _steady(e)]


def cornered(rig: Rig) -> bool:
    """Whether an effect is a function with corners, so that second derivatives mean nothing."""
    return any(e.get("id") == "table" for e in acting(rig).effects)


def steady_torques(rig: Rig, volts: FloatArray, states: FloatArray) -> FloatArray:
    """Torques of the effects that `unsteady` does not name, where both discs turn forward.

    Args:
        rig: parameters and effects.
        volts: V, shape (n,).
        states: twist (rad), omega_u, omega_l (rad/s), shape (n, 3).

    Returns:
        Nm on the upper and lower disc, shape (n, 2).

    Raises:
        InputError: an effect of the rig is wrong.
    """
    rig = rig.replace(effects=tuple(e for e in acting(rig).effects if _steady(e)))
    bundle, out = declared(rig), np.zeros((len(volts), 2))
    torques_at(
        kernel_record(rig)[0], bundle, new_memories(bundle), np.zeros(1, dtype=SIGNAL)[0],
        np.zeros(1, dtype=RESPONSE)[0], np.ascontiguousarray(volts, dtype=float),
        np.ascontiguousarray(states, dtype=float), out,
    )  # fmt: skip
    return out


def _senses(entry: Mapping[str, Any]) -> bool:
    name = entry.get("id")
    if name == "table":
        return entry.get("sort") == "error"
    return name in LIBRARY and LIBRARY[str(name)].senses


def _steady(entry: Mapping[str, Any]) -> bool:
    if entry.get("id") == "table":
        return entry.get("depends_on") in _STEADY_TABLES and "period" not in entry
    name = str(entry.get("id"))
    return name in LIBRARY and LIBRARY[name].steady
