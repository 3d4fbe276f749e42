"""Each controller's speeds over the open-loop diagram, panel by panel."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from drill_env._files import replacing
from drill_env.benchmark import open_loop_diagram
from drill_env.benchmark.measures import vibration_free
from drill_env.parameters import Rig
from drill_env.report.compare_map import compare_map
from drill_env.report.names import drawn

_BAD, _GOOD = "#c0392b", "#1f5fa8"
_GRID_POINTS = 121
MOST_BARS = 4
"""Most controllers whose bars are drawn, a column each: more would be too small to read."""


def _diagram(axes: Any, loop: pd.DataFrame) -> None:
    axes.fill_between(
        loop.equilibrium,
        loop["min"],
        loop["max"],
        color="0.88",
        label="open loop, constant voltage",
    )
    axes.plot(loop.equilibrium, loop.equilibrium, color="0.55", lw=0.8, label="set point")
    axes.axhline(0.0, color="0.7", lw=0.6)
    axes.spines[["top", "right"]].set_visible(False)


def _bars(axes: Any, group: pd.DataFrame) -> None:
    free = vibration_free(group)
    for part, colour, label in (
        (group[~free], _BAD, "min to max, vibrates or misses"),
        (group[free], _GOOD, "min to max, free of vibration"),
    ):
        axes.vlines(part.setpoint, part["min"], part["max"], color=colour, lw=2.0)
        axes.plot(part.setpoint, part["mean"], "o", color=colour, ms=3.5, label=label)


def compare_figure(runs: pd.DataFrame, rig: Rig, limit: float) -> Figure:
    """Bars from min to max of omega_l over the open-loop diagram.

    One column a controller, one row a start, so that no bars cover each other.

    Args:
        runs: table of `drill_env.benchmark.compare`.
        rig: for the open-loop diagram behind the bars.
        limit: voltage limit, V; the diagram reaches up to it.
    """
    starts = list(dict.fromkeys(runs.start))
    names = list(dict.fromkeys(runs.controller))
    loop = open_loop_diagram(rig, np.linspace(rig.breakaway_voltage * 1.02, limit, _GRID_POINTS))
    loop = loop[loop.equilibrium <= 1.06 * float(runs.setpoint.max())]
    size = (1.2 + 2.6 * max(len(names), 2), 0.9 + 2.4 * len(starts))
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(len(starts), len(names), sharex=True, sharey=True, squeeze=False)
    for start, line in zip(starts, panels, strict=True):
        for name, axes in zip(names, line, strict=True):
            group = runs[(runs.start == start) & (runs.controller == name)]
            _diagram(axes, loop)
            _bars(axes, group)
            count = f"{int(vibration_free(group).sum())} of {len(group)} free of vibration"
            title = f"{drawn(name)}, from {str(start).replace('_', ' ')}\n{count}"
            axes.set_title(title, fontsize=9, loc="left")
    figure.supxlabel("set point [rad/s]", fontsize=10)
    figure.supylabel(r"lower disc speed $\omega_l$ [rad/s]", fontsize=10)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside upper left", ncols=2 if len(names) < 3 else 4,
        frameon=False, fontsize=9,
    )  # fmt: skip
    return figure


def save_compare_picture(runs: pd.DataFrame, rig: Rig, limit: float, path: Path) -> None:
    """Write the picture of a comparison: bars for a few controllers, a map for many."""
    many = runs.controller.nunique() > MOST_BARS
    figure = compare_map(runs) if many else compare_figure(runs, rig, limit)
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=130, format="png")
