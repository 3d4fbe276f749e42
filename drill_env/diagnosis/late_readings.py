"""Readings of a late encoder, told at the time they speak of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drill_env._types import BoolArray, FloatArray, IntArray
from drill_env.effects.along import Motion

LATE = {"encoder_delay_upper": 0, "encoder_delay_lower": 1}
"""Effects that make a disc's readings late, and the disc."""

# Samples by which a reading that tells of a time may be off it.
_EVEN = 0.75


def _windows(restarts: IntArray, n: int) -> list[slice]:
    edges = [*restarts.tolist(), n]
    return [slice(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True)]


def telling(motion: Motion, delay: float) -> IntArray:
    """The row nearest to a delay after each row, shape (n,).

    Where no row is lost it is as many rows later throughout: were halfway between two samples now
    the one and now the other taken, some readings would count twice and tell too much.
    """
    out = np.zeros(len(motion.t), dtype=np.int64)
    for rows in _windows(motion.restarts, len(motion.t)):
        t = motion.t[rows]
        asked, usual = t + delay, float(np.median(np.diff(t))) if len(t) > 1 else 1.0
        after = np.clip(np.searchsorted(t, asked), 1, max(len(t) - 1, 1))
        before = asked - t[after - 1] < t[np.minimum(after, len(t) - 1)] - asked
        nearest = np.where(before, after - 1, after)
        later = np.minimum(np.arange(len(t)) + round(delay / usual), len(t) - 1)
        even = np.abs(t[later] - asked) < _EVEN * usual
        out[rows] = rows.start + np.where(even, later, nearest)
    return out


def on_time(
    read: FloatArray, motion: Motion, disc: int, delay: float, *, velocity: bool = False
) -> FloatArray:
    """What a late encoder says of each row's time, NaN where it would say it after the end.

    The reading nearest to a delay later is taken; the motion bridges what is left, half a sample
    or a little more. So it is the reading that tells where the disc was, and the motion, which may
    have been told with another delay, has no say in it.

    Args:
        read: angles as they were read, rad, or velocities, rad/s, shape (n,).
        motion: of the rig at the same rows.
        disc: 0 for the upper one, 1 for the lower one.
        delay: s.
        velocity: whether velocities were read.
    """
    rows = telling(motion, delay)
    rest = motion.t + delay - motion.t[rows]
    omega, alpha = motion.states[:, 1 + disc], motion.states[:, 4 + disc]
    move = rest * alpha if velocity else rest * (omega - 0.5 * rest * alpha)
    out = read[rows] + move
    out[unread(motion, delay)] = np.nan
    return out


def unread(motion: Motion, delay: float) -> BoolArray:
    """Rows of which a late encoder would tell only after the end or a gap, shape (n,)."""
    out = np.zeros(len(motion.t), dtype=np.bool_)
    for rows in _windows(motion.restarts, len(motion.t)):
        t = motion.t[rows]
        out[rows] = t + delay > t[-1] + 1e-9
    return out


def ahead(motion: Motion, disc: int, delay: float) -> Motion:
    """The motion behind late readings, when it was told by them as if they were not late."""
    later = motion.t + delay
    states = motion.states.copy()
    angle = states[:, 3] if disc else states[:, 3] + states[:, 0]
    angle = np.interp(later, motion.t, angle)
    for column in (1 + disc, 4 + disc):
        states[:, column] = np.interp(later, motion.t, states[:, column])
    upper = states[:, 3] + states[:, 0] if disc else angle
    lower = angle if disc else states[:, 3]
    states[:, 0], states[:, 3] = upper - lower, lower
    return replace(motion, states=states)
