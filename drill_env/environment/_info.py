"""The `info` of a step: the parts of the reward and the truth behind the sensors."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drill_env.environment._records import REWARD_TERMS
from drill_env.environment.core import EnvCore

_PARTS = tuple(f"reward_{name}" for name in REWARD_TERMS)


def all_info(core: EnvCore) -> dict[str, NDArray[Any]]:
    """Truth of all environments, one array an entry."""
    row = core.row
    y, mode = row["run"]["y"], row["run"]["mode"]
    info = {
        "twist": y[:, 0].copy(),
        "omega_u": y[:, 1].copy(),
        "omega_l": y[:, 2].copy(),
        "theta_u": y[:, 0] + y[:, 3],
        "theta_l": y[:, 3].copy(),
        "friction_torque_u": row["torque"][:, 0].copy(),
        "friction_torque_l": row["torque"][:, 1].copy(),
        "stuck_u": mode[:, 0] == 0,
        "stuck_l": mode[:, 1] == 0,
        "setpoint": row["setpoint"].copy(),
        "voltage": row["voltage"].copy(),
    }
    parts = row["parts"]
    return info | {name: parts[:, i].copy() for i, name in enumerate(_PARTS)}


def one_info(core: EnvCore) -> dict[str, Any]:
    """Truth of the only environment, plain numbers."""
    row = core.row[0]
    run = row["run"]
    twist, omega_u, omega_l, theta_l = run["y"].tolist()
    upper, lower, _ = run["mode"].tolist()
    torque_u, torque_l = row["torque"].tolist()
    return {
        "twist": twist,
        "omega_u": omega_u,
        "omega_l": omega_l,
        "theta_u": twist + theta_l,
        "theta_l": theta_l,
        "friction_torque_u": torque_u,
        "friction_torque_l": torque_l,
        "stuck_u": upper == 0,
        "stuck_l": lower == 0,
        "setpoint": float(row["setpoint"]),
        "voltage": float(row["voltage"]),
        **dict(zip(_PARTS, row["parts"].tolist(), strict=True)),
    }


def masked(info: dict[str, NDArray[Any]], mask: NDArray[np.bool_]) -> dict[str, Any]:
    """Gymnasium's vector convention: every entry with the mask of who has it."""
    out: dict[str, Any] = {}
    for name, values in info.items():
        out[name], out[f"_{name}"] = values, mask
    return out
