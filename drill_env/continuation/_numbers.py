"""A rig with one of its numbers, or of its effects' numbers, set."""

from __future__ import annotations

from drill_env._errors import InputError
from drill_env.effects import LIBRARY
from drill_env.parameters import SYMBOLS, Rig


def with_number(rig: Rig, name: str, value: float) -> Rig:
    """The rig with a number set.

    Args:
        rig: parameters and effects.
        name: one of `drill_env.parameters.SYMBOLS`, or an effect's id and the name of one of its
            numbers, as ``string_damping.damping``.
        value: in the number's unit.

    Raises:
        InputError: nothing of that name, or the value is unphysical.
    """
    if name in SYMBOLS:
        return rig.replace(**{name: float(value)})
    offered = effect_numbers(rig)
    if name not in offered:
        raise InputError(f"parameter is {name!r}: give one of {', '.join((*SYMBOLS, *offered))}")
    place, key = offered[name]
    entry = {**rig.effects[place], key: float(value)}
    LIBRARY[str(entry["id"])].vector({k: v for k, v in entry.items() if k != "id"})
    return rig.replace(effects=(*rig.effects[:place], entry, *rig.effects[place + 1 :]))


def effect_numbers(rig: Rig) -> dict[str, tuple[int, str]]:
    """Place of the effect and its key, of every number of its effects by name."""
    found: dict[str, tuple[int, str]] = {}
    for place, entry in enumerate(rig.effects):
        name = str(entry.get("id"))
        for parameter in LIBRARY[name].parameters if name in LIBRARY else ():
            found.setdefault(f"{name}.{parameter.name}", (place, parameter.name))
    return found
