"""Traces and readouts on the right of the picture."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, log10

import numpy as np
from numpy.typing import NDArray

from drill_env._types import FloatArray
from drill_env.environment._drawing import (
    ALARM,
    GRID,
    INK,
    MUTED,
    STAND,
    VOLTAGE,
    WHITE,
    Box,
    Canvas,
    Color,
    minus,
    ticks,
)
from drill_env.environment._frame import Frame, Traces, readable, stretches

_BLUSH: Color = (250, 224, 219)
_UPPER: Color = (38, 104, 172)
_LOWER: Color = (184, 118, 8)

_DASH = 0.03
"""Period of the set point's dashes as a share of the window."""


@dataclass(frozen=True, slots=True)
class Chart:
    """A plot area with axes against time.

    Attributes:
        box: the plot area in picture units.
        times: left and right end of the time axis in s.
        values: lower and upper end of the value axis.
    """

    box: Box
    times: tuple[float, float]
    values: tuple[float, float]

    def place(self, t: FloatArray, y: FloatArray) -> FloatArray:
        """Map samples to picture units.

        Args:
            t: times in s, shape (n,).
            y: values, shape (n,).

        Returns:
            Points, shape (n, 2).
        """
        left, top, width, height = self.box
        share_t = (t - self.times[0]) / (self.times[1] - self.times[0])
        share_y = (y - self.values[0]) / (self.values[1] - self.values[0])
        return np.column_stack([left + width * share_t, top + height * (1.0 - share_y)])

    def draw_axes(self, canvas: Canvas, title: str, *, time_labels: bool) -> None:
        """Draw the grid, the tick labels and the title.

        Args:
            canvas: where to draw.
            title: quantity and unit, set above the value axis.
            time_labels: whether the time axis is labelled too.
        """
        left, top, width, height = self.box
        canvas.text(title, (left, top - 12), 12, INK)
        marks = ticks(*self.values, 8 if height > 150 else 4)
        digits = max(0, -floor(log10(marks[1] - marks[0]) + 1e-9)) if len(marks) > 1 else 1
        for value in marks:
            y = float(self.place(np.array(self.times[:1]), np.array([value]))[0, 1])
            canvas.line(MUTED if value == 0.0 else GRID, (left, y), (left + width, y))
            canvas.text(minus(f"{value + 0.0:.{digits}f}"), (left - 7, y), 11, MUTED, "right")
        for time in ticks(*self.times, 6):
            x = float(self.place(np.array([time]), np.array(self.values[:1]))[0, 0])
            canvas.line(GRID, (x, top), (x, top + height))
            if time_labels:
                canvas.text(minus(f"{time:g}"), (x, top + height + 10), 11, MUTED, "center")
        if time_labels:
            canvas.text("time, s", (left + width, top + height + 25), 11, MUTED, "right")


def draw_charts(canvas: Canvas, traces: Traces, frame: Frame) -> None:
    """Speeds over voltage, the last seconds of both."""
    start = max(frame.t - traces.window_s, traces.frames[0].t)
    times = (start, start + traces.window_s)
    t, omega_u, omega_l = (traces.column(name) for name in ("t", "omega_u", "omega_l"))
    setpoint = traces.column("setpoint")

    bounds = _bounds(np.concatenate([omega_u, omega_l, setpoint]))
    speed = Chart((530.0, 124.0, 400.0, 220.0), times, bounds)
    # Sticking goes under the grid: a rig that never moves would hide it.
    canvas.box(WHITE, speed.box)
    _draw_sticking(canvas, speed, t, traces.column("stuck_l") > 0.0)
    speed.draw_axes(canvas, "Speed, rad/s", time_labels=False)
    _draw_legend(canvas)
    canvas.clip(speed.box)
    for points in _dashes(t, setpoint, _DASH * traces.window_s):
        canvas.polyline(MUTED, speed.place(*points), 1.5)
    canvas.clip(None)
    _draw_curve(canvas, speed, speed.place(t, omega_u), _UPPER)
    _draw_curve(canvas, speed, speed.place(t, omega_l), _LOWER)

    limit = 1.1 * frame.voltage_limit
    motor = Chart((530.0, 388.0, 400.0, 100.0), times, (-limit, limit))
    canvas.box(WHITE, motor.box)
    motor.draw_axes(canvas, "Voltage, V", time_labels=True)
    _draw_curve(canvas, motor, motor.place(t, traces.column("voltage")), VOLTAGE)


def _draw_sticking(canvas: Canvas, chart: Chart, t: FloatArray, stuck: NDArray[np.bool_]) -> None:
    _, top, _, height = chart.box
    canvas.clip(chart.box)
    for first, last in stretches(stuck):
        (x0, _), (x1, _) = chart.place(t[[first, last]], np.zeros(2))
        # Sticking shorter than a pixel is still worth seeing.
        extent = max(x1 - x0, 2.5)
        canvas.box(_BLUSH, (x0, top, extent, height))
        canvas.box(ALARM, (x0, top + height - 5.0, extent, 5.0))
    canvas.clip(None)


def _draw_curve(canvas: Canvas, chart: Chart, points: FloatArray, color: Color) -> None:
    canvas.clip(chart.box)
    if len(points) > 1:
        canvas.polyline(color, points, 2.0)
    canvas.clip(None)
    x, y = points[-1]
    canvas.ellipse(color, (x, y), 3.5, 3.5)


def _draw_legend(canvas: Canvas) -> None:
    for x, label, color in ((668.0, "upper", _UPPER), (734.0, "lower", _LOWER)):
        canvas.line(color, (x, 112.0), (x + 16.0, 112.0), 2.5)
        canvas.text(label, (x + 21.0, 112.0), 11, MUTED)
    for x in (798.0, 804.0, 810.0):
        canvas.line(MUTED, (x, 112.0), (x + 4.0, 112.0), 1.5)
    canvas.text("set point", (819.0, 112.0), 11, MUTED)
    canvas.box(_BLUSH, (880.0, 106.0, 14.0, 12.0))
    canvas.box(ALARM, (880.0, 115.0, 14.0, 3.0))
    canvas.text("stick", (899.0, 112.0), 11, MUTED)


def draw_readouts(canvas: Canvas, frame: Frame) -> None:
    """Time, speeds, twist and reward as numbers."""
    cells = (
        ("time, s", frame.t, INK),
        ("upper, rad/s", frame.omega_u, _UPPER),
        ("lower, rad/s", frame.omega_l, _LOWER),
        ("twist, rad", frame.theta_u - frame.theta_l, INK),
        ("reward", frame.reward, INK),
    )
    for k, (caption, value, color) in enumerate(cells):
        x = 492.0 + 91.0 * k
        canvas.text(caption, (x, 34.0), 11, MUTED)
        canvas.text(readable(value), (x, 57.0), 19, color)
    canvas.line(STAND, (492.0, 82.0), (930.0, 82.0))


def _dashes(t: FloatArray, y: FloatArray, period: float) -> list[tuple[FloatArray, FloatArray]]:
    """Cut a held signal into level dashes that stand still in time."""
    starts = period * np.arange(np.floor(t[0] / period), np.ceil(t[-1] / period) + 1)
    begin, end = np.clip(starts, t[0], t[-1]), np.clip(starts + 0.6 * period, t[0], t[-1])
    level = y[np.searchsorted(t, begin, side="right") - 1]
    shown = (end > begin) & np.isfinite(level)
    return [
        (np.array([a, b]), np.array([v, v]))
        for a, b, v in zip(begin[shown], end[shown], level[shown], strict=True)
    ]


def _bounds(values: FloatArray) -> tuple[float, float]:
    """Ends of an axis that shows finite values and zero, with room around them."""
    finite = values[np.isfinite(values)]
    low, high = min(0.0, float(finite.min())), max(1.0, float(finite.max()))
    room = 0.06 * (high - low)
    return low - room, high + room
