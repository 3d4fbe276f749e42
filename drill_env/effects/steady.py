"""Which effects leave a rig that can turn steadily."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from drill_env.effects import LIBRARY
from drill_env.parameters import Rig

_STEADY_TABLES = ("voltage", "twist", "omega_u", "omega_l", "omega_u - omega_l")


def acting(rig: Rig) -> Rig:
    """The rig without the effects that only its encoders show, and those of no size."""
    kept = (e for e in rig.effects if not (_is("senses", e) or _sizeless(e)))
    return rig.replace(effects=tuple(kept))


def lasting(rig: Rig) -> Rig:
    """The rig without the effects that a constant voltage or only its encoders leave nothing of."""
    kept = (e for e in acting(rig).effects if not _is("passing", e))
    return rig.replace(effects=tuple(kept))


def unsteady(rig: Rig) -> list[str]:
    """Ids of the effects with which the rig never turns steadily, see `Effect.autonomous`."""
    return [str(e.get("id")) for e in acting(rig).effects if not _is("autonomous", e)]


def cornered(rig: Rig) -> bool:
    """Whether an effect is a function with corners, so that second derivatives mean nothing."""
    return any(e.get("id") == "table" for e in acting(rig).effects)


def _is(what: str, entry: Mapping[str, Any]) -> bool:
    """A property of an `Effect`, or of a table."""
    name = str(entry.get("id"))
    if name != "table":
        return name in LIBRARY and bool(getattr(LIBRARY[name], what))
    steady = entry.get("depends_on") in _STEADY_TABLES and "period" not in entry
    return {"senses": entry.get("sort") == "error", "autonomous": steady, "passing": False}[what]


def _sizeless(entry: Mapping[str, Any]) -> bool:
    """Whether all that the effect is proportional to is 0."""
    name = str(entry.get("id"))
    numbers = LIBRARY[name].parameters if name in LIBRARY else ()
    sizes = [p.name for p in numbers if p.role == "amplitude"]
    return bool(sizes) and all(entry.get(size) == 0 for size in sizes)
