"""The diagram of a controlled rig as a still picture, over the open-loop one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from drill_env.continuation import Diagram
from drill_env.continuation.loop_diagram import LoopDiagram
from drill_env.continuation.loop_tables import loop_table, open_loop_rows
from drill_env.report.bifurcation_picture import STABLE, UNSTABLE, blank, mark_points, save
from drill_env.report.names import drawn

_COLOURS = {"none": "#9db7d5", "cycle": "#c0392b", "equilibrium": "k"}


def save_controlled_picture(
    found: LoopDiagram | None, name: str, settled: pd.DataFrame, open_loop: Diagram, path: Path
) -> None:
    """Write the controlled rig's motions over those of the rig at constant voltage.

    The open-loop motions stand at the speed of the equilibrium that shares their voltage.

    Args:
        found: diagram of the controlled rig, None where it cannot be continued.
        name: of the controller.
        settled: of `drill_env.benchmark.controlled_diagram`.
        open_loop: diagram up to the voltage limit.
        path: picture to write.
    """
    figure, axes = blank()
    high = float(settled.setpoint.max())
    free = open_loop_rows(open_loop, high)
    _draw(axes, free[free.kind == "cycle"], _COLOURS["none"], "cycles, constant voltage")
    if found is not None:
        table = loop_table(found, name)
        for kind in ("equilibrium", "cycle"):
            label = f"{'equilibria' if kind == 'equilibrium' else 'cycles'}, {drawn(name)}"
            _draw(axes, table[table.kind == kind], _COLOURS[kind], label)
        mark_points(axes, found.points)
    for start, mark in (("rest", "o"), ("limit_cycle", "x")):
        rows = settled[settled.start == start]
        for column, label in (("min", "_nolegend_"), ("max", f"settled from {start}")):
            axes.plot(
                rows.setpoint, rows[column], mark, ms=3.5, mfc="none", mew=0.8, color="0.35",
                label=label,
            )  # fmt: skip
    axes.set_xlabel("set point, or open-loop equilibrium [rad/s]")
    axes.set_xlim(0.0, 1.05 * high)
    axes.legend(frameon=False, fontsize=9)
    save(figure, path)


def _draw(axes: Any, table: pd.DataFrame, colour: str, label: str) -> None:
    if table.empty:
        return
    for _, rows in table.groupby("branch", sort=False):
        style = STABLE if bool(rows.stable.iloc[0]) else UNSTABLE
        sides = ("max",) if np.array_equal(rows["min"], rows["max"]) else ("min", "max")
        for column in sides:
            axes.plot(rows.setpoint, rows[column], style, color=colour, lw=1.3, label=label)
            label = "_nolegend_"
