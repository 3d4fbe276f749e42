"""The diagram of a controlled rig as tables and plain documents, beside the open-loop one."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import pandas as pd

from drill_env.continuation.branch import Point
from drill_env.continuation.diagram import Diagram
from drill_env.continuation.loop_diagram import LoopDiagram
from drill_env.continuation.loop_equilibria import motion_of
from drill_env.continuation.loop_flow import LoopMotion
from drill_env.continuation.special import SpecialPoint
from drill_env.continuation.tables import diagram_table, point_documents


def loop_table(found: LoopDiagram, name: str) -> pd.DataFrame:
    """Every computed motion of the controlled rig, one row each.

    Args:
        found: the diagram.
        name: of the controller.

    Returns:
        Columns controller, branch, kind (equilibrium, cycle), setpoint, min, max (rad/s),
        volts_min, volts_mean, volts_max (V), period (s, cycles), frequency (rad/s, of the
        leading mode or the cycle), growth_rate (1/s), stable, character, multiplier_1,
        multiplier_2 (by size), trivial, sticking_s, reversed_s, clock_s, newton_steps, residual.
    """
    branches = [found.equilibria, *found.branches]
    kinds = ["equilibrium", *["cycle"] * len(found.branches)]
    rows: list[dict[str, Any]] = []
    parts = {"equilibrium": 0, "cycle": 0}
    for branch, kind in zip(branches, kinds, strict=True):
        before = None
        for point in branch.points:
            # Each change of stability starts the next of e1, e2, ... or p1, p2, ...
            parts[kind] += point.cycle.stable != before
            before = point.cycle.stable
            label = f"{'e' if kind == 'equilibrium' else 'p'}{parts[kind]}"
            rows.append({"controller": name, "branch": label, "kind": kind} | _row(point, kind))
    return pd.DataFrame(rows)


def _row(point: Point, kind: str) -> dict[str, Any]:
    motion = motion_of(point)
    cycle = kind == "cycle"
    first, second = (abs(complex(m)) for m in motion.multipliers[:2])
    return {
        "setpoint": motion.parameter, "min": motion.min, "max": motion.max,
        "volts_min": motion.volts[0], "volts_mean": motion.volts[1],
        "volts_max": motion.volts[2], "period": motion.period if cycle else math.nan,
        "frequency": 2.0 * math.pi / motion.period if cycle else leading_frequency(motion),
        "growth_rate": motion.growth_rate, "stable": motion.stable,
        "character": motion.character if cycle else None, "multiplier_1": first,
        "multiplier_2": second, "trivial": motion.trivial, "sticking_s": motion.sticking_s,
        "reversed_s": motion.reversed_s, "clock_s": motion.clock, "newton_steps": motion.steps,
        "residual": motion.residual,
    }  # fmt: skip


def leading_frequency(motion: LoopMotion) -> float:
    """Frequency (rad/s) of an equilibrium's slowest decaying or fastest growing mode."""
    return abs(float(np.angle(motion.multipliers[0]))) / motion.clock


def open_loop_rows(diagram: Diagram, high: float) -> pd.DataFrame:
    """The open-loop diagram in the same columns, controller "none".

    Every voltage stands at the speed of the equilibrium that shares it.

    Args:
        diagram: open-loop diagram.
        high: largest set point, rad/s.
    """
    table = diagram_table(diagram)
    table = table[table.kind != "sticking set"]
    equilibria = diagram.equilibria
    order = np.argsort(equilibria.voltage)
    speed = np.interp(table.parameter, equilibria.voltage[order], equilibria.omega[order])
    rest = table.kind == "equilibrium"
    growth = np.log(table.multiplier_1.astype(float).clip(lower=1e-300)) / table.period
    real = equilibria.eigenvalues.real.max(axis=1)[order]
    growth = growth.where(~rest, np.interp(table.parameter, equilibria.voltage[order], real))
    out = table.assign(
        controller="none", setpoint=np.where(rest, table["max"], speed), growth_rate=growth,
        volts_min=table.parameter, volts_mean=table.parameter, volts_max=table.parameter,
        frequency=2.0 * np.pi / table.period,
    )  # fmt: skip
    out = out.drop(columns=["parameter", "twist_min", "twist_max"])
    return out[out.setpoint <= high].reset_index(drop=True)


def both_tables(found: LoopDiagram, name: str, open_loop: Diagram) -> pd.DataFrame:
    """The controlled rig's rows, then those at constant voltage."""
    ours = loop_table(found, name)
    return pd.concat([ours, open_loop_rows(open_loop, found.high)], ignore_index=True)


def loop_point_documents(points: Iterable[SpecialPoint]) -> list[dict[str, Any]]:
    """Special points as plain values; what does not exist is None."""
    return list(_documents(points))


def _documents(points: Iterable[SpecialPoint]) -> Iterator[dict[str, Any]]:
    points = list(points)
    for point, plain in zip(points, point_documents(points), strict=True):
        motion = point.cycle
        assert isinstance(motion, LoopMotion)
        plain.pop("name")
        plain["setpoint"] = plain.pop("parameter")
        plain["volts"] = motion.volts[1]
        known = math.isfinite(point.period)
        plain["frequency_rad_s"] = 2.0 * math.pi / point.period if known else None
        plain["multipliers"] = plain["multipliers"][:4]
        yield plain
