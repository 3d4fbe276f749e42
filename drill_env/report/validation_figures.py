"""The pictures of the validation page."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from drill_env._errors import InputError
from drill_env._types import FloatArray, IntArray
from drill_env.friction import lower_curve
from drill_env.identification.drive import UNIT
from drill_env.identification.estimate import Estimate
from drill_env.identification.validation import Validation
from drill_env.identification.whiteness import Whiteness
from drill_env.recordings import Channel

MEASURED, SIMULATED, PREDICTED = "#1f3b73", "#d1495b", "#e08e0b"
_POINTS = 2000
_DRAWS = 400
_SPEEDS = 160
_LABELS = {
    "theta_u": "θ<sub>u</sub>", "theta_l": "θ<sub>l</sub>",
    "omega_u": "ω<sub>u</sub>", "omega_l": "ω<sub>l</sub>",
}  # fmt: skip


def correlation_figure(estimate: Estimate) -> go.Figure:
    """Correlation of the free parameters, numbers on hover."""
    names = list(estimate.free)
    figure = go.Figure(
        go.Heatmap(
            z=np.round(estimate.correlation, 4), x=names, y=names, zmin=-1.0, zmax=1.0,
            colorscale="RdBu", colorbar={"thickness": 10, "tickvals": [-1, 0, 1]},
            hovertemplate="%{y}, %{x}: %{z}<extra></extra>",
        )
    )  # fmt: skip
    figure.update_yaxes(autorange="reversed")
    return _sized(figure, 420).update_layout(margin={"b": 60})


def friction_band(
    estimate: Estimate, top: float, level: float = 0.95
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Friction curve of the lower disc with its pointwise band.

    Args:
        estimate: a fit.
        top: highest speed, rad/s.
        level: share of the posterior within the band.

    Returns:
        Speeds (rad/s), curve, lower and upper edge (Nm), each of shape (n,).
    """
    speeds = np.linspace(0.0, top, _SPEEDS)
    curves = []
    for draw in estimate.draws(_DRAWS).tolist():
        try:
            rig = estimate.rig.replace(**dict(zip(estimate.free, draw, strict=True)))
        except InputError:
            # A draw past a bound makes no rig.
            continue
        curves.append(lower_curve(rig, speeds))
    middle = lower_curve(estimate.rig, speeds)
    low, high = np.quantile(curves or [middle], [0.5 - 0.5 * level, 0.5 + 0.5 * level], axis=0)
    return speeds, middle, low, high


def friction_figure(estimate: Estimate, top: float) -> go.Figure:
    """Friction torque of the lower disc over the speeds that the recordings visit."""
    speeds, middle, low, high = friction_band(estimate, top)
    figure = go.Figure()
    figure.add_scatter(
        x=np.concatenate([speeds, speeds[::-1]]), y=np.concatenate([high, low[::-1]]),
        fill="toself", fillcolor="rgba(209,73,91,0.25)", line={"width": 0}, hoverinfo="skip",
        name="95 % band",
    )  # fmt: skip
    figure.add_scatter(x=speeds, y=middle, name="estimate", line={"color": SIMULATED, "width": 2})
    figure.update_layout(xaxis_title="ω<sub>l</sub> [rad/s]", yaxis_title="T<sub>l</sub> [Nm]")
    return _sized(figure, 420)


def traces_figure(validation: Validation) -> go.Figure:
    """Voltage, then each channel measured and simulated with its error below, as in Fig. 3."""
    recording, result = validation.recording, validation.replay
    channels = list(result.simulated)
    heights = [0.7] + [1.4, 1.0] * len(channels)
    figure = make_subplots(
        len(heights), 1, shared_xaxes=True, row_heights=heights, vertical_spacing=0.025
    )
    t = recording.t - recording.t[0]
    rows = _stride(len(t))
    volts = recording.channel("u")[rows]
    figure.add_scatter(
        x=_short(t[rows]), y=_short(volts), line={"color": "#555", "width": 1, "shape": "hv"},
        name="voltage", showlegend=False, row=1, col=1,
    )  # fmt: skip
    figure.update_yaxes(title_text=f"u [{UNIT[recording.drive]}]", row=1, col=1)
    angle = "rad" if result.rig.inertias == 2 else "unit"
    for i, name in enumerate(channels):
        unit = f"{angle}/s" if name.startswith("omega") else angle
        _angle_rows(figure, validation, name, 2 + 2 * i, first=i == 0)
        figure.update_yaxes(title_text=f"{_LABELS[name]} [{unit}]", row=2 + 2 * i, col=1)
        figure.update_yaxes(title_text=f"error [{unit}]", row=3 + 2 * i, col=1)
    figure.update_xaxes(title_text="time [s]", row=len(heights), col=1)
    return _sized(figure, 260 + 200 * len(channels))


def _angle_rows(
    figure: go.Figure, validation: Validation, name: Channel, row: int, *, first: bool
) -> None:
    recording, result = validation.recording, validation.replay
    t, measured = recording.t - recording.t[0], recording.channel(name)
    rows = _stride(len(t))
    styles = ((measured, "experiment", MEASURED, "solid"),)
    for values, label, colour, dash in (
        *styles, (result.simulated[name], "simulation", SIMULATED, "dash")
    ):  # fmt: skip
        figure.add_scatter(
            x=_short(t[rows]), y=_short(values[rows]), name=label, legendgroup=label,
            showlegend=first, line={"color": colour, "dash": dash, "width": 1.3}, row=row, col=1,
        )  # fmt: skip
    errors = [(result.simulated, "error of the free run", SIMULATED)]
    if name in result.predicted:
        label = f"error, restarted every {result.horizon:g} s"
        errors.append((result.predicted, label, PREDICTED))
    for values, label, colour in errors:
        gap = measured - values[name]
        picked = _extremes(gap)
        figure.add_scatter(
            x=_short(t[picked]), y=_short(gap[picked]), name=label, legendgroup=label,
            showlegend=first, line={"color": colour, "width": 1.0}, row=row + 1, col=1,
        )  # fmt: skip


def correlation_curves(validation: Validation, *, voltage: bool) -> go.Figure:
    """Correlation of the innovations with themselves, or with the voltage, over the lag."""
    figure = go.Figure()
    tests = validation.residuals
    for name, test in tests.items():
        lags, values = _curve(test, voltage=voltage)
        figure.add_scatter(
            x=_short(lags), y=_short(values), name=_LABELS[name],
            line={"color": MEASURED if name.endswith("_u") else SIMULATED, "width": 1},
        )  # fmt: skip
    band = max(test.band for test in tests.values())
    figure.add_hrect(-band, band, fillcolor="#888", opacity=0.25, line_width=0, layer="below")
    curves = [_curve(test, voltage=voltage)[1] for test in tests.values()]
    largest = max((float(np.abs(c).max()) for c in curves if len(c)), default=0.0)
    edge = max(1.15 * largest, 2.5 * band)
    figure.update_yaxes(range=[-edge, edge], title_text="correlation")
    title = "lag behind the voltage [s]" if voltage else "lag [s]"
    figure.update_xaxes(title_text=title)
    return _sized(figure, 330)


def _curve(test: Whiteness, *, voltage: bool) -> tuple[FloatArray, FloatArray]:
    if voltage:
        return test.cross_lags, test.cross
    return test.lags, test.autocorrelation


def _sized(figure: go.Figure, height: int) -> go.Figure:
    # Room for a legend that a narrow screen breaks into lines.
    figure.update_layout(
        height=height, margin={"t": 12, "l": 56, "r": 12, "b": 100}, template="plotly_white",
        legend={"orientation": "h", "yref": "container", "y": 0.0, "yanchor": "bottom", "x": 0.0},
    )  # fmt: skip
    return figure


def _stride(size: int) -> slice:
    return slice(None, None, max(1, -(-size // _POINTS)))


def _extremes(values: FloatArray) -> IntArray:
    """Rows of the largest size in each of many spans: a stride would miss the peaks."""
    edges = np.unique(np.linspace(0, len(values), min(len(values), _POINTS) + 1).astype(int))
    sizes = np.abs(values)
    return np.array(
        [a + int(sizes[a:b].argmax()) for a, b in zip(edges[:-1], edges[1:], strict=True)]
    )


def _short(values: FloatArray) -> NDArray[np.float32]:
    return np.asarray(values, dtype=np.float32)
