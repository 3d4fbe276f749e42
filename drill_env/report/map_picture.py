"""Where vibration is possible, over voltage and one parameter."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from drill_env._files import replacing


def save_map_picture(table: pd.DataFrame, parameter: str, to_volts: float, path: Path) -> None:
    """Shade the range of stable vibration; lines are Hopf points and folds.

    Args:
        table: of `drill_env.continuation.vibration_map`.
        parameter: symbol on the vertical axis.
        to_volts: end of the voltage axis, V.
        path: picture to write.
    """
    figure = Figure(figsize=(7.5, 5.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    axes.fill_betweenx(
        table.value, table.vibration_from, table.vibration_to, color="#f3d9d5",
        label="stable vibration",
    )  # fmt: skip
    lines = (("hopf_low", "k", "-"), ("hopf_high", "k", "--"), ("fold", "#1f5fa8", "-"))
    for column, colour, style in lines:
        axes.plot(table[column], table.value, style, color=colour, label=column.replace("_", " "))
    axes.set_xlim(0.0, to_volts)
    axes.set_xlabel("voltage [V]")
    axes.set_ylabel(parameter)
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(frameon=False, ncols=4, loc="outside upper center")
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=150, format="png")
