"""The bifurcation diagram as a still picture, in the manner of the paper's Figs. 4 and 5."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from drill_env._files import replacing
from drill_env._types import FloatArray
from drill_env.continuation import CycleBranch, Diagram, ParameterDiagram, SpecialPoint
from drill_env.continuation.tables import cycle_rows, diagram_table

STABLE, UNSTABLE = "-", "--"
_COLOUR = {"sticking set": "k", "equilibrium": "k", "cycle": "#1f5fa8"}
_MARK = {
    "hopf": "o", "fold": "s", "grazing": "^", "reversal": "v", "last stick": "D",
    "break-away": "X", "non-smooth fold": "P", "neimark-sacker": "o", "period doubling": "*",
    "real crossing": "<",
}  # fmt: skip


def blank() -> tuple[Figure, Any]:
    """A figure and its axes for speeds of the lower disc."""
    figure = Figure(figsize=(8.0, 5.4), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    axes.set_ylabel(r"lower disc speed $\omega_l$ [rad/s]")
    axes.spines[["top", "right"]].set_visible(False)
    return figure, axes


def diagram_figure(diagram: Diagram, recorded: pd.DataFrame | None = None) -> Figure:
    """Equilibria and extremes of limit cycles over the voltage; stable solid, unstable dashed.

    Args:
        diagram: the computed diagram.
        recorded: columns voltage, min, max (rad/s) to lay over it as circles.
    """
    figure, axes = blank()
    for (_, kind), rows in diagram_table(diagram).groupby(["branch", "kind"], sort=False):
        style = STABLE if bool(rows.stable.iloc[0]) else UNSTABLE
        for column in ("min", "max"):
            axes.plot(rows.parameter, rows[column], style, color=_COLOUR[str(kind)], lw=1.3)
    mark_points(axes, diagram.points)
    draw_recorded(axes, recorded)
    axes.set_xlim(0.0, diagram.to_volts)
    axes.set_xlabel(r"$u_c$ [V]")
    axes.legend(frameon=False, fontsize=9)
    return figure


def draw_recorded(axes: Any, recorded: pd.DataFrame | None) -> None:
    """Lay recorded extremes, columns voltage, min and max, over a diagram as circles."""
    if recorded is None:
        return
    for column in ("min", "max"):
        label = "recorded" if column == "min" else None
        axes.plot(recorded.voltage, recorded[column], "o", mfc="none", color="#c0392b", label=label)


def mark_points(axes: Any, points: Iterable[SpecialPoint]) -> None:
    """Draw special points, one mark a kind."""
    seen: set[str] = set()
    for point in points:
        label = point.kind if point.kind not in seen else None
        seen.add(point.kind)
        speeds = {point.min, point.max}
        axes.plot(
            [point.parameter] * len(speeds), list(speeds), _MARK[point.kind], ms=5.0, ls="none",
            color="0.15", mfc="white", label=label, zorder=5,
        )  # fmt: skip
        if point.name:
            axes.annotate(
                point.name, (point.parameter, point.max), xytext=(5, 5),
                textcoords="offset points", fontsize=11, fontweight="bold",
            )  # fmt: skip


def save_diagram_picture(
    diagram: Diagram, path: Path, recorded: pd.DataFrame | None = None
) -> None:
    """Write the still picture."""
    save(diagram_figure(diagram, recorded), path)


def draw_cycles(axes: Any, branches: Iterable[CycleBranch], label: str, of: FloatArray) -> None:
    """Extremes of limit cycles; `of` (2, n) maps the continued parameter to the axis."""
    table = pd.DataFrame(list(cycle_rows(branches)))
    if table.empty:
        return
    for _, rows in table.groupby("branch", sort=False):
        style = STABLE if bool(rows.stable.iloc[0]) else UNSTABLE
        place = np.interp(rows.parameter, of[0], of[1])
        for column in ("min", "max"):
            axes.plot(place, rows[column], style, color=_COLOUR["cycle"], lw=1.3, label=label)
            label = "_nolegend_"


def save_parameter_picture(found: ParameterDiagram, path: Path) -> None:
    """Write the diagram over a parameter of the rig."""
    figure, axes = blank()
    table = found.equilibria
    for stable, style in ((True, STABLE), (False, UNSTABLE)):
        speed = table.omega.where(table.stable == stable)
        axes.plot(table.value, speed, style, color="k", lw=1.3)
    ends = np.array([table.value.min(), table.value.max()])
    draw_cycles(axes, found.branches, "limit cycles", np.array([ends, ends]))
    mark_points(axes, found.points)
    axes.set_xlim(*ends)
    axes.set_xlabel(f"{found.parameter} at {found.volts:g} V")
    axes.legend(frameon=False, fontsize=9)
    save(figure, path)


def save(figure: Figure, path: Path) -> None:
    """Write a figure, whole or not at all."""
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=150, format="png")
