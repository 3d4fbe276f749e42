"""Picture of the rig and its recent traces."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import cos, isfinite, pi, sin
from typing import Literal

import numpy as np
from gymnasium.error import ClosedEnvironmentError
from numpy.typing import NDArray

from drill_env._types import FloatArray
from drill_env.environment._drawing import (
    INK,
    MUTED,
    PAPER,
    WHITE,
    Box,
    Canvas,
    Chart,
    Color,
    Point,
    Window,
    minus,
    mix,
)

_STAND: Color = (208, 212, 216)
_STEEL: Color = (196, 204, 213)
_STEEL_SIDE: Color = (134, 145, 158)
_BRASS: Color = (222, 188, 104)
_BRASS_SIDE: Color = (166, 131, 58)
_SLACK: Color = (150, 156, 164)
_ALARM: Color = (206, 46, 40)
_BLUSH: Color = (250, 224, 219)
_UPPER: Color = (38, 104, 172)
_LOWER: Color = (184, 118, 8)
_VOLTAGE: Color = (30, 128, 104)

_AXIS = 190.0
_TILT = 0.28
_STRAND_RADIUS = 12.0
_STRANDS = 4
_RED_TWIST = 8.0
"""Twist in rad from which on the string is fully red: the rig reaches 6.6 rad at 5 V."""

STICK_BOX = (330.0, 412.0, 58.0, 22.0)
"""Where STICK appears while the lower disc sticks: left, top, width, height."""

_DASH = 0.03
"""Period of the set point's dashes as a share of the window."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One instant to draw, in SI units.

    Attributes:
        t: time in s.
        theta_u: angle of the upper disc in rad.
        theta_l: angle of the lower disc in rad.
        omega_u: speed of the upper disc in rad/s.
        omega_l: speed of the lower disc in rad/s.
        setpoint: speed asked of the discs in rad/s, nan if none.
        voltage: motor voltage in V.
        voltage_limit: largest voltage magnitude in V, above 0.
        stuck_u: whether the upper disc sticks.
        stuck_l: whether the lower disc sticks.
        reward: reward of the last step, nan before the first.
    """

    t: float
    theta_u: float
    theta_l: float
    omega_u: float
    omega_l: float
    setpoint: float
    voltage: float
    voltage_limit: float
    stuck_u: bool
    stuck_l: bool
    reward: float


class Traces:
    """The frames of the last seconds, thinned to what the picture can resolve."""

    _RESOLUTION = 600

    def __init__(self, window_s: float) -> None:
        """Start empty.

        Args:
            window_s: seconds to keep.
        """
        self.window_s = window_s
        self.frames: deque[Frame] = deque()

    def add(self, frame: Frame) -> None:
        """Append a frame and forget what left the window.

        A frame at the last one's time replaces it; one before it starts anew.

        Args:
            frame: the newest frame.
        """
        frames = self.frames
        if frames and frame.t < frames[-1].t:
            frames.clear()
        gap = self.window_s / self._RESOLUTION
        crowded = len(frames) > 1 and frame.t - frames[-2].t < gap
        if frames and (crowded or frame.t == frames[-1].t):
            frames.pop()
        frames.append(frame)
        # One frame before the window stays, so that the curves reach its left edge.
        while len(frames) > 1 and frames[1].t <= frame.t - self.window_s:
            frames.popleft()

    def column(self, name: str) -> FloatArray:
        """Collect one field of the frames.

        Args:
            name: field of `Frame`.

        Returns:
            Its values, oldest first, shape (n,).
        """
        return np.array([getattr(frame, name) for frame in self.frames], dtype=np.float64)


class Renderer:
    """Draws the rig and its traces, on the screen or into arrays."""

    def __init__(
        self,
        mode: Literal["human", "rgb_array"],
        *,
        fps: int,
        window_s: float = 10.0,
        size: tuple[int, int] = (960, 540),
    ) -> None:
        """Prepare the surfaces; a window opens with the first picture.

        Args:
            mode: "human" shows each picture in a window, "rgb_array" returns it.
            fps: frames per second the window keeps to.
            window_s: seconds of traces to show.
            size: width and height of the picture in pixels.

        Raises:
            DependencyNotInstalled: pygame is missing.
        """
        self._mode = mode
        self._fps = fps
        self._size = size
        self._canvas = Canvas(size)
        self._traces = Traces(window_s)
        self._window: Window | None = None
        self._closed = False

    def reset(self) -> None:
        """Clear the traces."""
        self._traces.frames.clear()

    def draw(self, frame: Frame) -> NDArray[np.uint8] | None:
        """Draw one instant.

        Args:
            frame: the instant; its trace is kept for the pictures that follow.

        Returns:
            The picture, shape (height, width, 3), or None in human mode. Once its
            window is closed, human mode draws nothing.

        Raises:
            ClosedEnvironmentError: asked for an array after `close`.
        """
        if self._closed:
            if self._mode == "human":
                return None
            raise ClosedEnvironmentError("the renderer is closed, make a new environment")
        self._traces.add(frame)
        self._canvas.begin()
        _draw_rig(self._canvas, frame)
        _draw_readouts(self._canvas, frame)
        self._draw_charts(frame)
        picture = self._canvas.finish()
        if self._mode == "rgb_array":
            return self._canvas.pixels()
        if self._window is None:
            self._window = Window(self._size, self._fps)
        if not self._window.show(picture):
            self.close()
        return None

    def close(self) -> None:
        """Close the window; again is harmless."""
        if self._window is not None:
            self._window.close()
        self._window = None
        self._closed = True

    def _draw_charts(self, frame: Frame) -> None:
        traces, canvas = self._traces, self._canvas
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
        _draw_curve(canvas, motor, motor.place(t, traces.column("voltage")), _VOLTAGE)


def _draw_sticking(canvas: Canvas, chart: Chart, t: FloatArray, stuck: NDArray[np.bool_]) -> None:
    _, top, _, height = chart.box
    canvas.clip(chart.box)
    for first, last in _stretches(stuck):
        (x0, _), (x1, _) = chart.place(t[[first, last]], np.zeros(2))
        # Sticking shorter than a pixel is still worth seeing.
        extent = max(x1 - x0, 2.5)
        canvas.box(_BLUSH, (x0, top, extent, height))
        canvas.box(_ALARM, (x0, top + height - 5.0, extent, 5.0))
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
    canvas.box(_ALARM, (880.0, 115.0, 14.0, 3.0))
    canvas.text("stick", (899.0, 112.0), 11, MUTED)


def _draw_readouts(canvas: Canvas, frame: Frame) -> None:
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
        canvas.text(_number(value), (x, 57.0), 19, color)
    canvas.line(_STAND, (492.0, 82.0), (930.0, 82.0))


def _draw_rig(canvas: Canvas, frame: Frame) -> None:
    _draw_stand(canvas)
    _draw_disc(canvas, 424.0, 82.0, 13.0, frame.theta_l, (_BRASS, _BRASS_SIDE))
    _draw_brake(canvas, frame.stuck_l)
    _draw_string(canvas, 157.0, 421.0, frame.theta_u, frame.theta_l)
    _draw_disc(canvas, 152.0, 116.0, 16.0, frame.theta_u, (_STEEL, _STEEL_SIDE))
    _draw_motor(canvas, frame.voltage, frame.voltage_limit)
    canvas.text("upper disc", (330.0, 148.0), 12, INK)
    canvas.text("steel", (330.0, 164.0), 11, MUTED)
    if frame.stuck_u:
        _draw_tag(canvas, (330.0, 176.0, 58.0, 22.0))
    twist = frame.theta_u - frame.theta_l
    canvas.text("string", (222.0, 282.0), 12, INK)
    canvas.text(f"{_number(twist / (2.0 * pi))} turns of twist", (222.0, 298.0), 11, MUTED)
    canvas.text("lower disc", (330.0, 476.0), 12, INK)
    canvas.text("brass", (330.0, 492.0), 11, MUTED)


def _draw_stand(canvas: Canvas) -> None:
    canvas.box(_STAND, (32.0, 40.0, 12.0, 466.0), 3.0)
    canvas.box(_STAND, (32.0, 60.0, 110.0, 10.0))
    canvas.box(_STAND, (22.0, 498.0, 300.0, 12.0), 3.0)
    canvas.box(_STAND, (_AXIS - 16.0, 474.0, 32.0, 24.0))
    canvas.box(_STEEL_SIDE, (_AXIS - 5.0, 440.0, 10.0, 34.0))


def _draw_motor(canvas: Canvas, voltage: float, limit: float) -> None:
    canvas.box(_STEEL_SIDE, (_AXIS - 5.0, 100.0, 10.0, 50.0))
    canvas.box(_STEEL, (_AXIS - 30.0, 88.0, 60.0, 16.0), 2.0)
    canvas.box(INK, (_AXIS - 58.0, 36.0, 116.0, 54.0), 5.0)
    canvas.text("DC motor", (_AXIS, 63.0), 13, WHITE, "center")

    left, width, y = 290.0, 136.0, 58.0
    middle = left + width / 2
    canvas.line(MUTED, (_AXIS + 58.0, 63.0), (left - 8.0, 63.0), 1.5)
    canvas.text(f"voltage  {_number(voltage)} V", (left, y - 14.0), 12, _VOLTAGE)
    canvas.box((228, 231, 233), (left, y, width, 10.0))
    reach = min(max(voltage / limit, -1.0), 1.0) * width / 2
    canvas.box(_VOLTAGE, (middle + min(reach, 0.0), y, abs(reach), 10.0))
    canvas.line(INK, (middle, y - 2.0), (middle, y + 12.0), 1.0)
    for x, label in ((left, minus(f"{-limit:g}")), (middle, "0"), (left + width, f"+{limit:g}")):
        canvas.text(label, (x, y + 20.0), 11, MUTED, "center")


def _draw_disc(
    canvas: Canvas,
    y: float,
    radius: float,
    height: float,
    angle: float,
    colors: tuple[Color, Color],
) -> None:
    face, side = colors
    flat = _TILT * radius
    canvas.ellipse(side, (_AXIS, y + height), radius, flat)
    canvas.box(side, (_AXIS - radius, y, 2.0 * radius, height))
    for k in range(12):
        dx, dy = _offset(angle + k * pi / 6.0, radius)
        if dy > 0.0:
            canvas.line(face, (_AXIS + dx, y + dy), (_AXIS + dx, y + dy + height), 1.0)
    canvas.ellipse(face, (_AXIS, y), radius, flat)
    canvas.ring(side, (_AXIS, y), 0.93 * radius, 0.93 * flat)
    for k in range(6):
        dx, dy = _offset(angle + k * pi / 3.0, 0.93 * radius)
        canvas.line(side, (_AXIS, y), (_AXIS + dx, y + dy), 2.0)
    wedge = [_offset(angle + turn, 0.93 * radius) for turn in np.linspace(-0.13, 0.13, 7)]
    canvas.polygon(_ALARM, [(_AXIS, y), *((_AXIS + dx, y + dy) for dx, dy in wedge)])
    canvas.ellipse(side, (_AXIS, y), 0.2 * radius, 0.2 * flat)


def _draw_string(canvas: Canvas, top: float, bottom: float, start: float, end: float) -> None:
    color = mix(_SLACK, _ALARM, abs(start - end) / _RED_TWIST)
    share = np.linspace(0.0, 1.0, 241)
    y = top + (bottom - top) * share
    strands = start + (end - start) * share + 2.0 * pi / _STRANDS * np.arange(_STRANDS)[:, None]
    for front in (False, True):
        for angle in strands:
            points = np.column_stack([_AXIS + _STRAND_RADIUS * np.cos(angle), y])
            # The far half is paler and painted first, so that the strands read as a helix.
            shown = (np.sin(angle) < 0.0) == front
            tone = color if front else mix(color, PAPER, 0.55)
            for first, last in _stretches(shown):
                if last > first:
                    canvas.polyline(tone, points[first : last + 1], 3.0)


def _draw_brake(canvas: Canvas, stuck: bool) -> None:
    canvas.box(_STAND, (300.0, 450.0, 14.0, 50.0))
    canvas.box(INK, (288.0, 414.0, 32.0, 40.0), 4.0)
    canvas.box(_ALARM if stuck else MUTED, (273.0, 421.0, 16.0, 24.0), 2.0)
    canvas.text("brake", (330.0, 444.0), 12, INK)
    if stuck:
        _draw_tag(canvas, STICK_BOX)


def _draw_tag(canvas: Canvas, box: Box) -> None:
    canvas.box(_ALARM, box, 4.0)
    center = (box[0] + box[2] / 2, box[1] + box[3] / 2)
    canvas.text("STICK", center, 13, WHITE, "center")


def _offset(angle: float, radius: float) -> Point:
    # Seen from above and in front: positive angles turn anticlockwise.
    return radius * cos(angle), -_TILT * radius * sin(angle)


def _stretches(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First true index of each run and the index just after it, or the last there is."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    ends = np.minimum(edges[1::2], len(mask) - 1)
    return list(zip(edges[::2].tolist(), ends.tolist(), strict=True))


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


def _number(value: float) -> str:
    """Format a value for reading at a glance, in eight characters at most."""
    if not isfinite(value):
        return "\u2013"
    if abs(value) >= 99_999.5:
        return minus(f"{value:.1e}")
    string = f"{value:.{2 if abs(value) < 999.995 else 1 if abs(value) < 9999.95 else 0}f}"
    return minus("0.00" if string == "-0.00" else string)
