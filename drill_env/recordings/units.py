"""Channels of a recording and the units in which files hold them."""

from __future__ import annotations

import math
from typing import Literal, TypeAlias, get_args

Channel: TypeAlias = Literal[
    "t", "u", "torque", "theta_u", "theta_l", "omega_u", "omega_l", "load_u", "load_l",
    "bridge", "added_inertia_u", "added_inertia_l",
]  # fmt: skip
CHANNELS: tuple[Channel, ...] = get_args(Channel)
ANGLES: tuple[Channel, ...] = ("theta_u", "theta_l")
VELOCITIES: tuple[Channel, ...] = ("omega_u", "omega_l")
LOADS: tuple[Channel, ...] = ("load_u", "load_l")
INERTIAS: tuple[Channel, ...] = ("added_inertia_u", "added_inertia_l")
"""One number for a whole recording, and no channel of it."""

_TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0}
_VOLTAGE = {"V": 1.0, "mV": 1e-3, "uV": 1e-6, "kV": 1e3}
# A linear axis is driven by a force.
_TORQUE = {
    "Nm": 1.0, "mNm": 1e-3, "uNm": 1e-6, "Ncm": 1e-2, "kNm": 1e3, "N": 1.0, "mN": 1e-3, "kN": 1e3,
}  # fmt: skip
# A linear axis is a one-inertia rig too, so its position may be a length.
_ANGLE = {
    "rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180.0, "turn": 2.0 * math.pi, "rev": 2.0 * math.pi,
    "m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6,
}  # fmt: skip
_VELOCITY = {f"{unit}/s": scale for unit, scale in _ANGLE.items()} | {"rpm": math.pi / 30.0}
# That of a linear axis is a mass.
_INERTIA = {"kgm2": 1.0, "gm2": 1e-3, "kgcm2": 1e-4, "gcm2": 1e-7, "kg": 1.0, "g": 1e-3}
UNITS: dict[Channel, dict[str, float]] = {
    "t": _TIME,
    "u": _VOLTAGE,
    "torque": _TORQUE,
    "theta_u": _ANGLE,
    "theta_l": _ANGLE,
    "omega_u": _VELOCITY,
    "omega_l": _VELOCITY,
    "load_u": _TORQUE,
    "load_l": _TORQUE,
    "bridge": {"1": 1.0},
    "added_inertia_u": _INERTIA,
    "added_inertia_l": _INERTIA,
}
DRIVES: tuple[Channel, ...] = ("u", "torque")
GIVEN: tuple[Channel, ...] = (*DRIVES, "bridge", *LOADS)
"""What acts on the rig, and is no reading of it."""
NUMBERED: tuple[Channel, ...] = (*GIVEN, *INERTIAS)
"""What a number may stand for in place of a column."""
COUNTED: dict[Channel, str] = {
    "theta_u": "counts", "theta_l": "counts", "omega_u": "counts/s", "omega_l": "counts/s",
}  # fmt: skip
"""Unit of a counted channel in a manifest, which knows the counts per revolution."""
