"""The diagram as tables and plain documents."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

import pandas as pd

from drill_env.continuation.diagram import Diagram
from drill_env.continuation.equilibria import sticking_set
from drill_env.continuation.special import SpecialPoint
from drill_env.continuation.tracer import CycleBranch

_STICKING_POINTS = 21


def diagram_table(diagram: Diagram) -> pd.DataFrame:
    """Every computed state, one row each.

    Returns:
        Columns branch, kind (sticking set, equilibrium, cycle), parameter (V), min, max
        (rad/s), twist_min, twist_max (rad, equilibria), period (s), stable, character,
        multiplier_1, multiplier_2 (by size), sticking_s, reversed_s, newton_steps, residual.
    """
    rows = [*_sticking_rows(diagram), *_equilibrium_rows(diagram), *cycle_rows(diagram.branches)]
    return pd.DataFrame(rows)


def _sticking_rows(diagram: Diagram) -> Iterator[dict[str, Any]]:
    rig = diagram.rig
    if rig.effects:
        # Equation (10) knows none: what holds a rig with effects at rest is not computed.
        return
    for k in range(_STICKING_POINTS):
        volts = rig.breakaway_voltage * k / (_STICKING_POINTS - 1)
        found = sticking_set(rig, volts)
        if found is not None:
            yield {
                "branch": "e1", "kind": "sticking set", "parameter": volts, "min": 0.0, "max": 0.0,
                "twist_min": found.twist[0], "twist_max": found.twist[1],
                "stable": found.attractive,
            }  # fmt: skip


def _equilibrium_rows(diagram: Diagram) -> Iterator[dict[str, Any]]:
    branch = diagram.equilibria
    part, before = 2, None
    for i in range(len(branch.omega)):
        stable = bool(branch.stable[i])
        # Each change of stability starts the next of the paper's pieces e2, e3, e4.
        part += before is not None and stable != before
        before = stable
        if branch.voltage[i] <= diagram.to_volts:
            yield {
                "branch": f"e{part}", "kind": "equilibrium", "parameter": branch.voltage[i],
                "min": branch.omega[i], "max": branch.omega[i], "twist_min": branch.twist[i],
                "twist_max": branch.twist[i], "stable": stable,
            }  # fmt: skip


def cycle_rows(branches: Iterable[CycleBranch]) -> Iterator[dict[str, Any]]:
    """Rows of limit cycles; each change of stability starts the next of p1, p2, ..."""
    part = 0
    for branch in branches:
        before = None
        for point in branch.points:
            cycle = point.cycle
            part += cycle.stable != before
            before = cycle.stable
            first, second = (abs(complex(m)) for m in cycle.multipliers[:2])
            yield {
                "branch": f"p{part}", "kind": "cycle", "parameter": cycle.parameter,
                "min": cycle.min, "max": cycle.max, "period": cycle.period,
                "stable": cycle.stable, "character": cycle.character, "multiplier_1": first,
                "multiplier_2": second, "sticking_s": cycle.sticking_s,
                "reversed_s": cycle.reversed_s, "newton_steps": cycle.steps,
                "residual": cycle.residual,
            }  # fmt: skip


def point_documents(points: Iterable[SpecialPoint]) -> list[dict[str, Any]]:
    """Special points as plain values; what does not exist is None."""
    return [
        {
            "name": point.name or None,
            "kind": point.kind,
            "parameter": point.parameter,
            "omega": _number(point.omega),
            "min": _number(point.min),
            "max": _number(point.max),
            "period_s": _number(point.period),
            "multipliers": [[m.real, m.imag] for m in point.multipliers],
            "how": point.how,
            "error": point.error,
            "remark": point.remark or None,
        }
        for point in points
    ]


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
