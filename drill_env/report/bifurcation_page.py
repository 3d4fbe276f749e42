"""The bifurcation diagram as a page: hover for numbers, click for the cycle behind a point."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
from jinja2 import Environment
from jinja2.utils import htmlsafe_json_dumps
from markupsafe import Markup

from drill_env._files import write_text
from drill_env.continuation import Diagram, Point
from drill_env.continuation.tables import diagram_table
from drill_env.integrator import simulate

_TRACES, _SAMPLES = 160, 160

_SCRIPT = """
const cycles = CYCLES;
const plot = document.getElementById('{plot_id}');
plot.on('plotly_click', event => {
  const key = event.points[0].customdata && event.points[0].customdata[0];
  if (key === undefined || key < 0) return;
  const c = cycles[key];
  const options = {responsive: true, displayModeBar: false};
  const title = c.title;
  Plotly.newPlot('trace', [
    {x: c.t, y: c.omega_l, name: 'lower disc'}, {x: c.t, y: c.omega_u, name: 'upper disc'}],
    {title: {text: title}, xaxis: {title: {text: 'time [s]'}}, margin: {t: 40},
     yaxis: {title: {text: 'speed [rad/s]'}}}, options);
  Plotly.newPlot('phase', [{x: c.twist, y: c.omega_l, mode: 'lines'}],
    {title: {text: 'phase portrait'}, xaxis: {title: {text: 'twist [rad]'}}, margin: {t: 40},
     yaxis: {title: {text: 'lower disc [rad/s]'}}}, options);
});
"""

_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{{ heading }}</title>
<style>body{font-family:system-ui,sans-serif;margin:1rem;max-width:1200px}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(320px,1fr));gap:1rem}
.pair div{min-height:340px}table{border-collapse:collapse;font-size:.9rem}
td,th{padding:.2rem .6rem;border-bottom:1px solid #ddd;text-align:right}
.wide{overflow-x:auto}</style></head>
<body><h1>{{ heading }}</h1>
<p>Solid: stable. Dashed: unstable. Click a limit cycle to see it.</p>
{{ plot }}<div class="pair"><div id="trace"></div><div id="phase"></div></div>
<h2>Special points</h2><div class="wide">{{ table }}</div></body></html>
"""


def save_diagram_page(diagram: Diagram, path: Path) -> None:
    """Write the interactive page, one file that needs no network."""
    picked, keys = _picked(diagram)
    figure = _figure(diagram, keys)
    traces = [_cycle_trace(diagram, point) for point in picked]
    write_text(path, page(figure, traces, _point_table(diagram), "Bifurcation diagram"))


def page(figure: go.Figure, traces: list[dict[str, Any]], table: Markup, heading: str) -> str:
    """The whole page.

    Args:
        figure: its markers' first custom number points into `traces`, or is negative.
        traces: title, t, omega_l, omega_u and twist of a cycle.
        table: special points, as HTML.
        heading: of the page.
    """
    plot = figure.to_html(
        full_html=False, include_plotlyjs=True, config={"responsive": True},
        post_script=_SCRIPT.replace("CYCLES", htmlsafe_json_dumps(traces)),
    )  # fmt: skip
    template = Environment(autoescape=True).from_string(_PAGE)
    # Plotly writes "<" in names as \u003c, so that no name ends the script.
    return template.render(heading=heading, plot=Markup(plot), table=table)


def _picked(diagram: Diagram) -> tuple[list[Point], dict[float, int]]:
    """Cycles whose traces are stored, and for each parameter the nearest of them."""
    every = [point for branch in diagram.branches for point in branch.points]
    stride = max(1, len(every) // _TRACES)
    picked = every[::stride]
    keys = {float(point.arclength): i // stride for i, point in enumerate(every)}
    return picked, {k: min(v, len(picked) - 1) for k, v in keys.items()}


def _cycle_trace(diagram: Diagram, point: Point) -> dict[str, Any]:
    cycle = point.cycle
    run = simulate(
        diagram.rig, cycle.parameter, cycle.period, initial=np.append(cycle.state, 0.0),
        t_eval=np.linspace(0.0, cycle.period, _SAMPLES), rtol=1e-8,
    )  # fmt: skip
    columns = {"t": run.t, "omega_l": run.omega_l, "omega_u": run.omega_u, "twist": run.twist}
    title = f"cycle at {cycle.parameter:.4f} V, period {cycle.period:.5f} s"
    return {"title": title, "period": cycle.period} | {
        name: [round(float(v), 5) for v in values] for name, values in columns.items()
    }


def _figure(diagram: Diagram, keys: dict[float, int]) -> go.Figure:
    figure = go.Figure()
    rest = diagram_table(diagram)
    rest = rest[rest.kind != "cycle"]
    for name, rows in rest.groupby("branch", sort=False):
        dash = "solid" if bool(rows.stable.iloc[0]) else "dash"
        figure.add_scatter(
            x=rows.parameter, y=rows["max"], name=str(name), mode="lines",
            line={"color": "black", "dash": dash},
        )  # fmt: skip
    for branch in diagram.branches:
        for stable in (True, False):
            _add_cycles(figure, [p for p in branch.points if p.cycle.stable == stable], keys)
    figure.update_layout(
        xaxis_title="voltage [V]", yaxis_title="lower disc speed [rad/s]", height=560,
        margin={"t": 20, "l": 50, "r": 20}, legend={"orientation": "h", "y": -0.18},
    )  # fmt: skip
    return figure


def _add_cycles(figure: go.Figure, points: list[Point], keys: dict[float, int]) -> None:
    if not points:
        return
    stable = points[0].cycle.stable
    data = [
        [keys[float(p.arclength)], p.cycle.period, abs(p.cycle.multipliers[0]), p.cycle.character]
        for p in points
    ]
    for side in ("max", "min"):
        figure.add_scatter(
            x=[p.cycle.parameter for p in points],
            y=[getattr(p.cycle, side) for p in points],
            customdata=data, mode="lines+markers", marker={"size": 4},
            name=f"{'stable' if stable else 'unstable'} cycles, {side}",
            line={"color": "#1f5fa8", "dash": "solid" if stable else "dash"},
            hovertemplate=(
                "%{x:.5f} V, %{y:.5f} rad/s<br>period %{customdata[1]:.6f} s<br>"
                "multiplier %{customdata[2]:.5f}<br>%{customdata[3]}<extra></extra>"
            ),
        )  # fmt: skip


def _point_table(diagram: Diagram) -> Markup:
    def period(seconds: float) -> str:
        return f"{seconds:.6f}" if math.isfinite(seconds) else ""

    head = ("name", "kind", "V", "min", "max", "period s")
    rows = [
        (p.name, p.kind, f"{p.parameter:.8f}", f"{p.min:.6f}", f"{p.max:.6f}", period(p.period))
        for p in diagram.points
    ]
    return html_table(head, rows)


def html_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Markup:
    """A plain table whose cells are text."""
    cells = [("th", head), *(("td", row) for row in rows)]
    lines = [
        Markup("<tr>{}</tr>").format(
            Markup().join(Markup("<{0}>{1}</{0}>").format(Markup(tag), cell) for cell in row)
        )
        for tag, row in cells
    ]
    return Markup("<table>{}</table>").format(Markup().join(lines))
