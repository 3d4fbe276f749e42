"""What one line of the fleet's table says of a rig."""

from __future__ import annotations

from datetime import date
from typing import Any

import pyarrow as pa

from drill_env.diagnosis.result import DiagnosisResult, Number, digits_of
from drill_env.diagnosis.since import Since

_NUMBER = pa.struct(
    [("effect", pa.string()), ("name", pa.string()), ("value", pa.float64()),
     ("low", pa.float64()), ("high", pa.float64()), ("unit", pa.string())]
)  # fmt: skip
SCHEMA = pa.schema(
    [
        ("name", pa.string()), ("verdict", pa.string()), ("missing", pa.string()),
        ("probability", pa.float64()), ("numbers", pa.string()), ("component", pa.string()),
        ("depends_on", pa.string()), ("since", pa.date32()), ("last_without", pa.date32()),
        ("cpu_s", pa.float64()), ("error", pa.string()), ("remarks", pa.string()),
        ("parameters", pa.list_(_NUMBER)), ("digest", pa.string()),
    ]
)  # fmt: skip
"""Columns of a rig's part; null where they do not apply, `error` where the diagnosis failed."""


def row_of(result: DiagnosisResult, began: Since | None) -> dict[str, Any]:
    """The row of a rig that was diagnosed, without name, time and digest."""
    named = [(e.id, name, n) for e in result.effects for name, n in e.parameters.items()]
    changed = _changed(result) if result.verdict == "parameters" else []
    located = result.located
    return {
        "verdict": result.verdict,
        "missing": _missing(result),
        "probability": _probability(result),
        "numbers": "; ".join([*(_short(*one) for one in named), *changed]) or None,
        "component": located.component if located else None,
        "depends_on": located.depends_on if located else None,
        "since": began.first if began else None,
        "last_without": began.last_without if began else None,
        "parameters": [
            {"effect": effect, "name": name, "value": n.value, "low": n.low, "high": n.high,
             "unit": n.unit}
            for effect, name, n in named
        ],
    }  # fmt: skip


def _missing(result: DiagnosisResult) -> str | None:
    if result.effects:
        return " + ".join(effect.id for effect in result.effects)
    if result.shape is not None:
        return f"no name: {result.shape.sort} over {result.shape.coordinate}"
    return "no name" if result.verdict == "unexplained" else None


def _probability(result: DiagnosisResult) -> float | None:
    """Of the first name; of a shape without one that it sits where it was located."""
    if result.effects:
        return result.effects[0].probability
    if result.shape is not None and result.grades is not None:
        return result.grades.component_probability
    return None


def _short(effect: str, name: str, number: Number) -> str:
    return f"{effect} {name} {_interval(number.value, number.low, number.high)} {number.unit}"


def _changed(result: DiagnosisResult) -> list[str]:
    """Parameters whose intervals do not hold what was given."""
    return [
        f"{name} {_interval(c.after, c.low, c.high)}, given {c.before:.4g}"
        for name, c in result.parameters_changed.items()
        if not c.low <= c.before <= c.high
    ]


def _interval(value: float, low: float, high: float) -> str:
    digits = digits_of(value, low, high)
    return f"{value:.{digits}g} [{low:.{digits}g}, {high:.{digits}g}]"


def told_since(first: date | None, last_without: date | None) -> str:
    """Since when, in words."""
    if first is None:
        return ""
    return f"{first}" if last_without is not None else f"{first} or before"
