"""Drawings as SVG inside a page: the page's own colours and font, light and dark."""

from __future__ import annotations

import io
import re
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from drill_env._types import FloatArray, IntArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Matplotlib needs colours it knows; in the SVG they turn into the page's variables.
INK, SOFT, GRID = "#1a0001", "#1a0002", "#1a0003"
MEASURED, BEFORE, AFTER, SHADE = "#1a0004", "#1a0005", "#1a0006", "#1a0007"
_VARIABLES = {
    INK: "ink", SOFT: "soft", GRID: "grid", MEASURED: "measured", BEFORE: "before",
    AFTER: "after", SHADE: "shade",
}  # fmt: skip
_WIDTH = 5.2
_POINTS = 500
# Margins for the words beside and above the axes, inches.
_LEFT, _RIGHT, _BELOW, _ABOVE, _BETWEEN = 0.82, 0.1, 0.44, 0.26, 0.3

_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none", "font.size": 8.5, "axes.edgecolor": SOFT, "axes.labelcolor": INK,
    "text.color": INK, "xtick.color": SOFT, "ytick.color": SOFT, "xtick.labelcolor": INK,
    "ytick.labelcolor": INK, "axes.grid": True, "grid.color": GRID, "grid.linewidth": 0.5,
    "axes.spines.top": False, "axes.spines.right": False, "axes.linewidth": 0.6,
    "legend.frameon": False, "legend.fontsize": 8.0, "legend.handlelength": 1.4,
    "axes.axisbelow": True, "axes.formatter.limits": (-3, 4), "axes.formatter.useoffset": False,
}  # fmt: skip


def page_style() -> AbstractContextManager[None]:
    """Settings under which the drawings are made."""
    import matplotlib as mpl

    return mpl.rc_context(_STYLE)


def new_figure(heights: tuple[float, ...], height: float, *, shared: bool = True) -> Figure:
    """A drawing of one column, as wide as a telephone shows without shrinking.

    Args:
        heights: of its rows, relative.
        height: of all, inches.
        shared: whether the rows share the abscissa.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(_WIDTH, height))
    figure.patch.set_alpha(0.0)
    # Fixed margins: a layout that is sought draws every figure twice.
    rows = len(heights)
    each = (height - _BELOW - _ABOVE - (rows - 1) * _BETWEEN) / rows
    figure.subplots_adjust(
        left=_LEFT / _WIDTH, right=1.0 - _RIGHT / _WIDTH, bottom=_BELOW / height,
        top=1.0 - _ABOVE / height, hspace=(_BETWEEN if shared else _BETWEEN + _BELOW) / each,
    )  # fmt: skip
    axes = figure.subplots(len(heights), 1, sharex=shared, height_ratios=heights, squeeze=False)
    for axis in axes[:, 0]:
        axis.patch.set_alpha(0.0)
    return figure


def legend(axis: Axes, columns: int = 4) -> None:
    """A legend above the axes, where it covers no curve."""
    axis.legend(
        loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=columns, borderpad=0.1,
        columnspacing=1.0, handletextpad=0.4,
    )  # fmt: skip


def extremes(values: FloatArray, points: int = _POINTS) -> IntArray:
    """Rows of the least and greatest value in each of many spans, ascending."""
    edges = np.unique(np.linspace(0, len(values), points + 1).astype(int))
    filled = np.where(np.isfinite(values), values, 0.0)
    rows = {
        a + int(pick(filled[a:b]))
        for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)
        for pick in (np.argmin, np.argmax)
    }
    return np.array(sorted(rows), dtype=np.int64)


def inline(figure: Figure, name: str, label: str) -> Markup:
    """The drawing as an <svg> element.

    Args:
        figure: drawn under `page_style`.
        name: that no other drawing of the page has.
        label: what it shows, for those who cannot see it.
    """
    import matplotlib as mpl

    out = io.StringIO()
    nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    with mpl.rc_context({**_STYLE, "svg.hashsalt": name}):
        figure.savefig(out, format="svg", metadata=nothing)
    text = out.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r'<g id="[^"]*"', "<g", text)
    text = re.sub(r' d="[^"]*"', lambda found: _shortened(found.group()), text)
    text = re.sub(r"font: ([\d.]+)px [^;\"]*", r"font: \1px system-ui, sans-serif", text)
    for colour, variable in _VARIABLES.items():
        text = text.replace(colour, f"var(--{variable})")
    # Sizes come from the page.
    text = re.sub(r'<svg [^>]*viewBox="([^"]*)"[^>]*>', rf"<svg viewBox='\1' {_role(label)}>", text)
    return Markup(text)


def _shortened(path: str) -> str:
    """A path's numbers to a hundredth, less than any screen shows."""
    return re.sub(r"(\.\d\d)\d+", r"\1", path)


def _role(label: str) -> str:
    return f'xmlns:xlink="http://www.w3.org/1999/xlink" role="img" aria-label="{label}"'
