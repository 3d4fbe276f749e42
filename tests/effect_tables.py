"""The library as the tables of docs/effects.md: print `library_tables()` to renew them."""

from __future__ import annotations

from typing import get_args

from drill_env import Rig
from drill_env.diagnosis.offered import offered_effects
from drill_env.effects import LIBRARY, Effect
from drill_env.effects._effect import Component, EffectParameter
from drill_env.prediction.offer import _possible

_HEAD = (
    "| effect | discs | parameters | formula | taken for | source |\n|---|---|---|---|---|---|\n"
)

# Without any parameter that an effect of the library stands for.
_AXIS = Rig.one_inertia(km=1.0, Ju=1.0, Tsu=0.0, bu=0.0)
_TWO = Rig(Tsu=0.0, dTsu=0.0, bu=0.0, dbu=0.0)


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
    name = f"`{effect.id}`<br>{effect.meaning}"
    cells = (name, _discs(effect), parameters, formula, taken, effect.source)
    return "| " + " | ".join(cells) + " |\n"


def _discs(effect: Effect) -> str:
    """The numbers of discs of the rigs to which a search offers it."""
    offered = {
        1: _possible(effect, _AXIS, amplifier=True),
        2: effect in offered_effects(_TWO, ()),
    }
    return ", ".join(str(n) for n, there in offered.items() if there)


def _parameter(parameter: EffectParameter) -> str:
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    return f"`{parameter.name}`, {parameter.low:g} to {parameter.high:g}{unit}"
