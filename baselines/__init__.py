"""Classical controllers, one a file, all behind `drill_env.controllers.Controller`."""

from __future__ import annotations

from collections.abc import Callable

from drill_env._errors import InputError
from drill_env.controllers import Controller
from drill_env.environment.config import EnvConfig

from .active_damping import ActiveDamping
from .open_loop import OpenLoop
from .pi import SpeedPI

CONTROLLERS: dict[str, Callable[[EnvConfig], Controller]] = {
    "open-loop": OpenLoop,
    "pi": SpeedPI,
    "active-damping": ActiveDamping,
}
"""Makers by the name the command line uses."""


def make(name: str, config: EnvConfig) -> Controller:
    """The controller `name`, designed for the nominal rig of `config`.

    Raises:
        InputError: the name is unknown.
    """
    if name not in CONTROLLERS:
        raise InputError(f"controller {name!r} is unknown; known: {', '.join(CONTROLLERS)}")
    return CONTROLLERS[name](config)


__all__ = ["CONTROLLERS", "ActiveDamping", "OpenLoop", "SpeedPI", "make"]
