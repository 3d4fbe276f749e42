"""The rig as it stands: motor, discs, string and brake."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np

from drill_env.environment._drawing import (
    ALARM,
    INK,
    MUTED,
    PAPER,
    STAND,
    VOLTAGE,
    WHITE,
    Box,
    Canvas,
    Color,
    Point,
    minus,
    mix,
)
from drill_env.environment._frame import Frame, readable, stretches

_STEEL: Color = (196, 204, 213)
_STEEL_SIDE: Color = (134, 145, 158)
_BRASS: Color = (222, 188, 104)
_BRASS_SIDE: Color = (166, 131, 58)
_SLACK: Color = (150, 156, 164)

_AXIS = 190.0
_TILT = 0.28
_STRAND_RADIUS = 12.0
_STRANDS = 4
_RED_TWIST = 8.0
"""Twist in rad from which on the string is fully red: the rig reaches 6.6 rad at 5 V."""

STICK_BOX = (330.0, 412.0, 58.0, 22.0)
"""Where STICK appears while the lower disc sticks: left, top, width, height."""


def draw_rig(canvas: Canvas, frame: Frame) -> None:
    """The rig on the left of the picture."""
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
    canvas.text(f"{readable(twist / (2.0 * pi))} turns of twist", (222.0, 298.0), 11, MUTED)
    canvas.text("lower disc", (330.0, 476.0), 12, INK)
    canvas.text("brass", (330.0, 492.0), 11, MUTED)


def _draw_stand(canvas: Canvas) -> None:
    canvas.box(STAND, (32.0, 40.0, 12.0, 466.0), 3.0)
    canvas.box(STAND, (32.0, 60.0, 110.0, 10.0))
    canvas.box(STAND, (22.0, 498.0, 300.0, 12.0), 3.0)
    canvas.box(STAND, (_AXIS - 16.0, 474.0, 32.0, 24.0))
    canvas.box(_STEEL_SIDE, (_AXIS - 5.0, 440.0, 10.0, 34.0))


def _draw_motor(canvas: Canvas, voltage: float, limit: float) -> None:
    canvas.box(_STEEL_SIDE, (_AXIS - 5.0, 100.0, 10.0, 50.0))
    canvas.box(_STEEL, (_AXIS - 30.0, 88.0, 60.0, 16.0), 2.0)
    canvas.box(INK, (_AXIS - 58.0, 36.0, 116.0, 54.0), 5.0)
    canvas.text("DC motor", (_AXIS, 63.0), 13, WHITE, "center")

    left, width, y = 290.0, 136.0, 58.0
    middle = left + width / 2
    canvas.line(MUTED, (_AXIS + 58.0, 63.0), (left - 8.0, 63.0), 1.5)
    canvas.text(f"voltage  {readable(voltage)} V", (left, y - 14.0), 12, VOLTAGE)
    canvas.box((228, 231, 233), (left, y, width, 10.0))
    reach = min(max(voltage / limit, -1.0), 1.0) * width / 2
    canvas.box(VOLTAGE, (middle + min(reach, 0.0), y, abs(reach), 10.0))
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
    canvas.polygon(ALARM, [(_AXIS, y), *((_AXIS + dx, y + dy) for dx, dy in wedge)])
    canvas.ellipse(side, (_AXIS, y), 0.2 * radius, 0.2 * flat)


def _draw_string(canvas: Canvas, top: float, bottom: float, start: float, end: float) -> None:
    color = mix(_SLACK, ALARM, abs(start - end) / _RED_TWIST)
    share = np.linspace(0.0, 1.0, 241)
    y = top + (bottom - top) * share
    strands = start + (end - start) * share + 2.0 * pi / _STRANDS * np.arange(_STRANDS)[:, None]
    for front in (False, True):
        for angle in strands:
            points = np.column_stack([_AXIS + _STRAND_RADIUS * np.cos(angle), y])
            # The far half is paler and painted first, so that the strands read as a helix.
            shown = (np.sin(angle) < 0.0) == front
            tone = color if front else mix(color, PAPER, 0.55)
            for first, last in stretches(shown):
                if last > first:
                    canvas.polyline(tone, points[first : last + 1], 3.0)


def _draw_brake(canvas: Canvas, stuck: bool) -> None:
    canvas.box(STAND, (300.0, 450.0, 14.0, 50.0))
    canvas.box(INK, (288.0, 414.0, 32.0, 40.0), 4.0)
    canvas.box(ALARM if stuck else MUTED, (273.0, 421.0, 16.0, 24.0), 2.0)
    canvas.text("brake", (330.0, 444.0), 12, INK)
    if stuck:
        _draw_tag(canvas, STICK_BOX)


def _draw_tag(canvas: Canvas, box: Box) -> None:
    canvas.box(ALARM, box, 4.0)
    center = (box[0] + box[2] / 2, box[1] + box[3] / 2)
    canvas.text("STICK", center, 13, WHITE, "center")


def _offset(angle: float, radius: float) -> Point:
    # Seen from above and in front: positive angles turn anticlockwise.
    return radius * cos(angle), -_TILT * radius * sin(angle)
