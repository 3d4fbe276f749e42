"""The diagram of a controlled rig as a page, beside the open-loop one."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import plotly.graph_objects as go
from markupsafe import Markup

from drill_env._files import write_text
from drill_env._types import FloatArray
from drill_env.continuation import Point
from drill_env.continuation.flow import CycleError
from drill_env.continuation.loop_diagram import LoopDiagram
from drill_env.continuation.loop_equilibria import motion_of
from drill_env.continuation.loop_flow import LoopMotion
from drill_env.report.bifurcation_page import html_table, page

_TRACES = 60
_SAMPLES = 4
_COLOURS = {"none": "#9db7d5", "cycle": "#c0392b", "equilibrium": "black"}


def save_controlled_page(found: LoopDiagram, name: str, table: pd.DataFrame, path: Path) -> None:
    """Write the interactive page, one file that needs no network.

    Args:
        found: the diagram.
        name: of the controller.
        table: of `drill_env.continuation.loop_tables.both_tables`.
        path: page to write.
    """
    every = [point for branch in found.branches for point in branch.points]
    stride = max(1, math.ceil(len(every) / _TRACES))
    traces = [_trace(found, point) for point in every[::stride]]
    figure = _figure(table, name, stride)
    heading = f"Bifurcation diagram under {name}"
    write_text(path, page(figure, traces, _point_table(found), heading))


def _trace(found: LoopDiagram, point: Point) -> dict[str, Any]:
    motion = motion_of(point)
    clock = float(point.z[-2]) / motion.beats
    state, modes, rows = point.z[:-2], None, []
    for k in range(motion.beats):
        try:
            step = found.loop.advance(state, clock, motion.parameter, modes, sensitivity=False)
        except CycleError:
            break
        rows.append([k * clock, *state[:3]])
        state, modes = step.state, step.run.final_modes
    rows.append([motion.beats * clock, *state[:3]])
    columns: FloatArray = np.array(rows)
    title = f"cycle at {motion.parameter:.4f} rad/s, period {motion.period:.5f} s"
    names = ("t", "twist", "omega_u", "omega_l")
    return {"title": title, "period": motion.period} | {
        key: [round(float(v), 5) for v in columns[:, i]] for i, key in enumerate(names)
    }


def _figure(table: pd.DataFrame, name: str, stride: int) -> go.Figure:
    figure, done = go.Figure(), 0
    free = table[(table.controller == "none") & (table.kind == "cycle")]
    for branch, rows in free.groupby("branch", sort=False):
        _add(figure, rows, f"constant voltage, {branch}", _COLOURS["none"], [-1] * len(rows))
    ours = table[table.controller == name]
    for (branch, kind), rows in ours.groupby(["branch", "kind"], sort=False):
        keys = [-1] * len(rows)
        if kind == "cycle":
            keys = [(done + i) // stride for i in range(len(rows))]
            done += len(rows)
        _add(figure, rows, f"{name}, {branch}", _COLOURS[str(kind)], keys)
    figure.update_layout(
        xaxis_title="set point, or open-loop equilibrium [rad/s]",
        yaxis_title="lower disc speed [rad/s]", height=560,
        margin={"t": 20, "l": 50, "r": 20}, legend={"orientation": "h", "y": -0.18},
    )  # fmt: skip
    return figure


def _add(figure: go.Figure, rows: pd.DataFrame, name: str, colour: str, keys: list[int]) -> None:
    data = [
        [key, volts, rate, size, period, character or ""]
        for key, volts, rate, size, period, character in zip(
            keys, rows.volts_mean, rows.growth_rate, rows.multiplier_1, rows.period,
            rows.character.where(rows.character.notna(), ""), strict=True,
        )
    ]  # fmt: skip
    for side in ("max", "min") if (rows["max"] != rows["min"]).any() else ("max",):
        figure.add_scatter(
            x=rows.setpoint, y=rows[side], customdata=data, mode="lines+markers",
            marker={"size": 4}, name=name, legendgroup=name, showlegend=side == "max",
            line={"color": colour, "dash": "solid" if bool(rows.stable.iloc[0]) else "dash"},
            hovertemplate=(
                "%{x:.5f} rad/s set, %{y:.5f} rad/s, %{customdata[1]:.4f} V<br>"
                "growth %{customdata[2]:.5f} 1/s, multiplier %{customdata[3]:.5f}<br>"
                "period %{customdata[4]:.6f} s %{customdata[5]}<extra></extra>"
            ),
        )  # fmt: skip


def _point_table(found: LoopDiagram) -> Markup:
    head = ("kind", "set point", "V", "min", "max", "period s", "error", "remark")
    rows = [
        (
            p.kind, f"{p.parameter:.8f}",
            f"{p.cycle.volts[1]:.6f}" if isinstance(p.cycle, LoopMotion) else "",
            f"{p.min:.6f}", f"{p.max:.6f}", f"{p.period:.6f}", f"{p.error:.0e}", p.remark,
        )
        for p in found.points
    ]  # fmt: skip
    return html_table(head, rows)
