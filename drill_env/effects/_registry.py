"""The library of effects, filled from its folder, from installed packages and by call."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Mapping
from importlib.metadata import entry_points
from types import MappingProxyType, ModuleType
from typing import get_args

from drill_env._errors import InputError
from drill_env.effects import library
from drill_env.effects._effect import Component, Effect

_FOUND: dict[str, Effect] = {}

LIBRARY: Mapping[str, Effect] = MappingProxyType(_FOUND)
"""Every effect by its id: from the motor down to the sensors, then by name."""


def register(effect: Effect) -> Effect:
    """Add an effect to the library: it simulates, trains and is searched like the others.

    Args:
        effect: its declaration; an effect that is there under the same id is replaced.

    Returns:
        The effect.

    Raises:
        InputError: the declaration is no `Effect`, or its component is unknown.
    """
    if not isinstance(effect, Effect):
        raise InputError(f"effect is {effect!r}: give a drill_env.effects.Effect")
    if effect.id == "table":
        raise InputError("effect id table belongs to measured curves: give another id")
    components = get_args(Component)
    if effect.component not in components:
        raise InputError(
            f"effect {effect.id}: component is {effect.component!r}; give one of "
            f"{', '.join(components)}"
        )
    known = {**_FOUND, effect.id: effect}
    _FOUND.clear()
    _FOUND.update(
        sorted(known.items(), key=lambda item: (components.index(item[1].component), item[0]))
    )
    return effect


def load_library() -> None:
    """Register what lies in the folder `library`."""
    for module in pkgutil.iter_modules(library.__path__):
        _register_from(importlib.import_module(f"{library.__name__}.{module.name}"))


def load_installed() -> None:
    """Register the effects that installed packages offer."""
    for point in entry_points(group="drill_env.effects"):
        offered = point.load()
        if isinstance(offered, ModuleType):
            _register_from(offered)
        else:
            register(offered)


def _register_from(module: ModuleType) -> None:
    for offered in vars(module).values():
        if isinstance(offered, Effect):
            register(offered)
