"""Numbers of the effects that a rig file holds: known as well as the rig's own, and fitted so."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drill_env._types import FloatArray
from drill_env.effects import LIBRARY, EffectParameter
from drill_env.parameters import Rig


@dataclass(frozen=True, slots=True)
class Given:
    """One number of an effect that a rig file holds.

    Attributes:
        place: of the effect in the file.
        effect: its id.
        name: of the number.
        value: as given.
        unit: of the value.
        size: what a coordinate of 1 adds to it; 0 where the coordinate is its logarithm.
    """

    place: int
    effect: str
    name: str
    value: float
    unit: str
    size: float

    @property
    def label(self) -> str:
        """What tables call it."""
        return f"{self.effect}.{self.name}"

    def at(self, x: float) -> float:
        """Its value at a coordinate, 0 of which is the given one."""
        return self.value + self.size * x if self.size else self.value * math.exp(x)

    def coordinate(self, value: float) -> float:
        """Where it has a value."""
        return (value - self.value) / self.size if self.size else math.log(value / self.value)

    def slope(self, x: float) -> float:
        """Derivative of the value by the coordinate."""
        return self.size or self.at(x)


def given_numbers(rig: Rig) -> tuple[Given, ...]:
    """Numbers of a rig's effects that are fitted with it: all but tables and those that are 0."""
    return tuple(
        _given(place, str(entry["id"]), parameter, float(entry[parameter.name]))
        for place, entry in enumerate(rig.effects)
        if entry.get("id") in LIBRARY
        for parameter in LIBRARY[str(entry["id"])].parameters
        if parameter.role == "phase" or float(entry[parameter.name]) != 0.0
    )


def _given(place: int, effect: str, parameter: EffectParameter, value: float) -> Given:
    # Of an angle the doubt is that share of a radian, of what may change its sign one of its size.
    size = 1.0 if parameter.role == "phase" else abs(value) if parameter.low < 0.0 else 0.0
    return Given(place, effect, parameter.name, value, parameter.unit, size)


def moved(
    effects: Sequence[Mapping[str, Any]], given: Sequence[Given], x: FloatArray
) -> list[dict[str, Any]]:
    """Effects with their given numbers at some coordinates, shape (len(given),)."""
    out = [dict(entry) for entry in effects]
    for one, coordinate in zip(given, x.tolist(), strict=True):
        out[one.place][one.name] = one.at(coordinate)
    return out
