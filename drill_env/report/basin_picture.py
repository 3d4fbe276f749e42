"""Which start goes where."""

from __future__ import annotations

from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from drill_env._files import replacing
from drill_env.continuation.basins import Basins

_COLOURS = {
    "equilibrium": "#1b8a5a", "limit cycle": "#c0392b", "rest": "#1f5fa8",
    "another equilibrium": "#b8860b", "undecided": "0.6",
}  # fmt: skip


def save_basin_picture(found: Basins, path: Path) -> None:
    """Starts in the plane of twist and omega_l, coloured by where they end."""
    figure = Figure(figsize=(6.5, 5.2), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    for fate, colour in _COLOURS.items():
        rows = found.starts[found.starts.fate == fate]
        if len(rows):
            axes.plot(
                rows.twist, rows.omega_l, "o", ms=3.0, color=colour, label=f"{fate}: {len(rows)}"
            )
    axes.set_xlabel("twist [rad]; omega_u, drawn too, is not shown")
    axes.set_ylabel("lower disc speed [rad/s]")
    axes.set_title(
        f"{found.volts:g} V: {found.share:.1%} to the equilibrium "
        f"({found.low:.1%} to {found.high:.1%})", fontsize=10, loc="left",
    )  # fmt: skip
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(frameon=False, ncols=3, loc="outside lower center")
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=150, format="png")
