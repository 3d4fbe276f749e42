"""The library as the tables of docs/effects.md: print `library_tables()` to renew them."""

from __future__ import annotations

from typing import get_args

from drill_env.effects import LIBRARY, Effect
from drill_env.effects._effect import Component, EffectParameter

_HEAD = "| effect | parameters | formula | taken for | source |\n|---|---|---|---|---|\n"


def library_tables() -> str:
    """One Markdown table of effects for each component of the rig."""
    parts = []
    for component in get_args(Component):
        rows = [_row(effect) for effect in LIBRARY.values() if effect.component == component]
        parts.append(f"### {component.capitalize()}\n\n{_HEAD}{''.join(rows)}")
    return "\n".join(parts)


def _row(effect: Effect) -> str:
    parameters = "<br>".join(_parameter(p) for p in effect.parameters)
    taken = ", ".join(f"`{name}`" for name in (*effect.neighbours, *effect.aliases))
    formula = effect.formula.replace("|", "\\|")
    cells = (f"`{effect.id}`<br>{effect.meaning}", parameters, formula, taken, effect.source)
    return "| " + " | ".join(cells) + " |\n"


def _parameter(parameter: EffectParameter) -> str:
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    return f"`{parameter.name}`, {parameter.low:g} to {parameter.high:g}{unit}"
