"""The bifurcation diagram as a still picture, in the manner of the paper's Figs. 4 and 5."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from drill_env._files import replacing
from drill_env.continuation import Diagram
from drill_env.continuation.tables import diagram_table

_STABLE, _UNSTABLE = "-", "--"
_COLOUR = {"sticking set": "k", "equilibrium": "k", "cycle": "#1f5fa8"}
_MARK = {
    "hopf": "o", "fold": "s", "grazing": "^", "reversal": "v", "last stick": "D",
    "break-away": "o", "non-smooth fold": "P",
}  # fmt: skip


def diagram_figure(diagram: Diagram, recorded: pd.DataFrame | None = None) -> Figure:
    """Equilibria and extremes of limit cycles over the voltage; stable solid, unstable dashed.

    Args:
        diagram: the computed diagram.
        recorded: columns voltage, min, max (rad/s) to lay over it as circles.
    """
    figure = Figure(figsize=(8.0, 5.4), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    for (_, kind), rows in diagram_table(diagram).groupby(["branch", "kind"], sort=False):
        style = _STABLE if bool(rows.stable.iloc[0]) else _UNSTABLE
        for column in ("min", "max"):
            axes.plot(rows.parameter, rows[column], style, color=_COLOUR[str(kind)], lw=1.3)
    _mark_points(axes, diagram)
    if recorded is not None:
        for column in ("min", "max"):
            label = "recorded" if column == "min" else None
            axes.plot(
                recorded.voltage, recorded[column], "o", mfc="none", color="#c0392b", label=label
            )
    axes.set_xlim(0.0, diagram.to_volts)
    axes.set_xlabel(r"$u_c$ [V]")
    axes.set_ylabel(r"lower disc speed $\omega_l$ [rad/s]")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=9)
    return figure


def _mark_points(axes: Any, diagram: Diagram) -> None:
    seen: set[str] = set()
    for point in diagram.points:
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
    with replacing(path) as temporary:
        diagram_figure(diagram, recorded).savefig(temporary, dpi=150, format="png")
