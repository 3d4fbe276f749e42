"""Each controller's speeds over the open-loop diagram."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from drill_env._files import replacing
from drill_env.benchmark import open_loop_diagram
from drill_env.parameters import Rig

_COLOURS = ("#c0392b", "#1f5fa8", "#1b8a5a", "#8e44ad", "#d68910", "#16a2b8", "#7f6000", "#555555")
_GRID_POINTS = 121


def _diagram(axes: Any, rig: Rig, limit: float, top: float) -> None:
    volts = np.linspace(rig.breakaway_voltage * 1.02, limit, _GRID_POINTS)
    loop = open_loop_diagram(rig, volts)
    loop = loop[loop.equilibrium <= top]
    axes.fill_between(
        loop.equilibrium, loop["min"], loop["max"], color="0.88", label="open loop: min to max"
    )
    axes.plot(loop.equilibrium, loop.equilibrium, color="0.45", lw=1.0, label="wanted speed")
    axes.axhline(0.0, color="0.6", lw=0.6)


def compare_figure(runs: pd.DataFrame, rig: Rig, limit: float) -> Figure:
    """Vertical bars from min to max of omega_l at each set point, one panel a start.

    Args:
        runs: table of `drill_env.benchmark.compare`.
        rig: for the open-loop diagram behind the bars.
        limit: voltage limit, V; the diagram reaches up to it.
    """
    starts = list(dict.fromkeys(runs.start))
    names = list(dict.fromkeys(runs.controller))
    points = np.sort(runs.setpoint.unique())
    figure = Figure(figsize=(11.0, 4.6), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, len(starts), sharey=True, squeeze=False)[0]
    for axes, start in zip(panels, starts, strict=True):
        _diagram(axes, rig, limit, float(points.max()) * 1.06)
        for i, name in enumerate(names):
            group = runs[(runs.start == start) & (runs.controller == name)]
            shift = (i - 0.5 * (len(names) - 1)) * 0.012 * float(points.max())
            colour = _COLOURS[i % len(_COLOURS)]
            x = group.setpoint + shift
            axes.vlines(x, group["min"], group["max"], color=colour, lw=2.2, label=name)
            axes.plot(x, group["mean"], "o", color=colour, ms=3.0)
        axes.set_title(f"start: {start.replace('_', ' ')}", fontsize=10, loc="left")
        axes.set_xlabel("set point [rad/s]")
        axes.spines[["top", "right"]].set_visible(False)
    panels[0].set_ylabel(r"lower disc speed $\omega_l$ [rad/s]")
    panels[0].legend(frameon=False, fontsize=9, loc="upper left")
    return figure


def save_compare_picture(runs: pd.DataFrame, rig: Rig, limit: float, path: Path) -> None:
    """Write the picture of a comparison."""
    with replacing(path) as temporary:
        compare_figure(runs, rig, limit).savefig(temporary, dpi=150, format="png")
