"""The bifurcation diagram of a rig with effects as a still picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from drill_env.continuation.extended_diagram import ExtendedDiagram
from drill_env.report.bifurcation_picture import (
    STABLE,
    UNSTABLE,
    blank,
    draw_cycles,
    draw_recorded,
    mark_points,
    save,
)

_WAYS = {"up": ("^", "#1f5fa8"), "down": ("v", "#e08e2b")}


def extended_figure(diagram: ExtendedDiagram, recorded: pd.DataFrame | None = None) -> Figure:
    """Equilibria and limit cycles as lines, what the rig settles on as marks, over the voltage.

    Args:
        diagram: of a rig with effects.
        recorded: columns voltage, min, max (rad/s) to lay over it as circles.
    """
    figure, axes = blank()
    branch = diagram.equilibria
    if branch is not None:
        for stable, style in ((True, STABLE), (False, UNSTABLE)):
            speed = np.where(branch.stable == stable, branch.omega, np.nan)
            axes.plot(branch.voltage, speed, style, color="k", lw=1.3)
    for way, (mark, colour) in _WAYS.items():
        rows = diagram.attractors[diagram.attractors.direction == way]
        for column in ("min", "max"):
            label = f"settled, voltage going {way}" if column == "min" else None
            axes.plot(rows.voltage, rows[column], mark, ms=4.0, color=colour, label=label)
    ends = np.array([0.0, diagram.to_volts])
    draw_cycles(axes, diagram.branches, "limit cycles", np.array([ends, ends]))
    draw_recorded(axes, recorded)
    mark_points(axes, diagram.points)
    axes.set_xlim(0.0, diagram.to_volts)
    axes.set_xlabel(r"$u_c$ [V]")
    axes.legend(frameon=False, fontsize=9)
    return figure


def save_extended_picture(
    diagram: ExtendedDiagram, path: Path, recorded: pd.DataFrame | None = None
) -> None:
    """Write the still picture."""
    save(extended_figure(diagram, recorded), path)
