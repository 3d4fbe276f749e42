"""Many controllers at a glance: the severity index over controllers and set points."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from drill_env.benchmark.measures import vibration_free
from drill_env.report.names import drawn

_LEAST, _MOST = 1e-3, 2.0
_WIDTH, _ROW, _HEAD = 11.5, 0.27, 1.3


def compare_map(runs: pd.DataFrame) -> Figure:
    """One row a controller, one column a set point, one block a start.

    The colour is the severity index of the lower disc's speed, on a logarithmic scale; a dot marks
    a run that is free of vibration and on its set point.

    Args:
        runs: table of `drill_env.benchmark.compare`.
    """
    starts, names = list(dict.fromkeys(runs.start)), list(dict.fromkeys(runs.controller))
    figure = Figure(figsize=(_WIDTH, _HEAD + _ROW * len(names)), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, len(starts), sharey=True, squeeze=False)[0]
    image = None
    for start, axes in zip(starts, panels, strict=True):
        image = _block(axes, runs[runs.start == start], names)
        axes.set_title(f"from {str(start).replace('_', ' ')}", fontsize=10, loc="left")
        axes.set_xlabel("set point [rad/s]")
    if image is not None:
        bar = figure.colorbar(image, ax=list(panels), extend="both", pad=0.01, fraction=0.03)
        bar.set_label("severity index of stick-slip (0: none, 1: down to rest)")
    figure.suptitle(
        "Dot: free of vibration and on the set point; at the right, how many of the set points",
        fontsize=9, x=0.01, ha="left",
    )  # fmt: skip
    return figure


def _block(axes: Axes, runs: pd.DataFrame, names: list[str]) -> AxesImage:
    setpoints = sorted(set(runs.setpoint))
    table = runs.assign(free=vibration_free(runs)).groupby(["controller", "setpoint"])
    index = pd.MultiIndex.from_product([names, setpoints])
    shape = (len(names), len(setpoints))
    severity = table.severity_index.mean().reindex(index).to_numpy(float).reshape(shape)
    free = table.free.all().reindex(index, fill_value=False).to_numpy(bool).reshape(shape)
    # A run that failed has no index; it is shown as the worst.
    shown = np.where(np.isfinite(severity), np.clip(severity, _LEAST, None), _MOST)
    image = axes.imshow(shown, norm=LogNorm(_LEAST, _MOST), cmap="cividis_r", aspect="auto")
    rows, columns = np.nonzero(free)
    axes.plot(columns, rows, "o", color="white", markeredgecolor="black", ms=4, mew=0.7)
    for row in range(len(names)):
        axes.text(
            len(setpoints) - 0.35, row, f"{int(free[row].sum())}/{len(setpoints)}",
            va="center", fontsize=8,
        )  # fmt: skip
    axes.set_xlim(-0.5, len(setpoints) + 0.6)
    axes.set_xticks(range(len(setpoints)), [f"{s:g}" for s in setpoints], fontsize=8)
    axes.set_yticks(range(len(names)), [drawn(name) for name in names], fontsize=9)
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    return image
