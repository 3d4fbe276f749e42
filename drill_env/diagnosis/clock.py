"""What is known of a recording's own faults, told to the filter before physics is looked for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import norm, poisson

from drill_env._types import BoolArray, FloatArray, IntArray
from drill_env.diagnosis.glitches import without_glitches
from drill_env.identification.noise import shiver
from drill_env.identification.samples import Samples
from drill_env.prediction.criteria import Criteria
from drill_env.recordings import Channel, Recording

_NAMES: tuple[Channel, Channel] = ("theta_u", "theta_l")
_STALE_SPEED = 5.0
# Rows over which the speed is told, more than go missing in a row.
_STALE_REACH = 12
_SPEED_REACH = 4
# Steps that the first one after lost rows is at least as long as, 2, and after a rest at most, 1:
# between the two.
_MADE_UP = 1.5

FEWEST = 5
"""Stale rows that make a fault."""


def stale_rows(recording: Recording) -> tuple[BoolArray, int]:
    """Rows that repeat the one before while the rig turned, shape (n,), and how many turned.

    None where noise of several counts makes so many by chance, or where the discs stood.
    """
    none = np.zeros(len(recording), dtype=np.bool_)
    angles = recording.angles()
    step = np.array([recording.quanta.get(name, 0.0) for name in angles])
    if len(angles) < 2 or not (step > 0).all() or len(recording) <= 2 * _STALE_REACH:
        return none, 0
    values = np.column_stack(list(angles.values()))
    # The ways before and after show that a disc passes several counts a row, and where it turns
    # back that it does not.
    rows = np.arange(_STALE_REACH, len(values) - _STALE_REACH)
    gone, left = (values[rows + k] - values[rows + k - _STALE_REACH] for k in (0, _STALE_REACH))
    slower = np.where(gone * left > 0.0, np.minimum(np.abs(gone), np.abs(left)), 0.0)
    slower /= _STALE_REACH * step
    turning = (slower > _STALE_SPEED).any(axis=1)
    same = (values[rows] == values[rows - 1]).all(axis=1) & turning
    noise = np.array([shiver(column) for column in values.T])
    noise = np.maximum(noise / step, 1.0 / math.sqrt(12.0))
    expected = float(_repeated_by_chance(slower[turning], noise).prod(axis=1).sum())
    if poisson.sf(same.sum() - 1, expected) < norm.sf(Criteria().z):
        ways = np.sign(gone) * (slower > _STALE_SPEED) / step
        if _caught_up(values, rows[same], ways[same]):
            none[rows] = same
    return none, int(turning.sum())


def _caught_up(values: FloatArray, rows: IntArray, ways: FloatArray) -> bool:
    """Whether readings make up for the rows that they missed, in their sum.

    After a lost row the next step is at least two steps long, and usual again after that. A disc
    that stood begins with a step that is no longer than those to come.

    Args:
        values: readings, shape (n, c).
        rows: that repeat the one before, ascending.
        ways: what turns each encoder's steps there into counts along its motion; 0 where it stands.
    """
    last = np.append(np.diff(rows) != 1, True)
    ends, ways = rows[last], ways[last]
    first, later = (float((ways * (values[ends + k] - values[ends + k - 1])).sum()) for k in (1, 2))
    return first > _MADE_UP * later


def _repeated_by_chance(speed: FloatArray, noise: FloatArray) -> FloatArray:
    """Probability that each encoder shows the same count twice running, shape (n, c).

    That of a difference of 0 counts, whose distribution is normal.

    Args:
        speed: in counts a row, shape (n, c).
        noise: standard deviation of each encoder's readings, counts, shape (c,).
    """
    spread = math.sqrt(2.0) * noise
    return np.minimum(norm.pdf(speed / spread) / spread, 1.0)


def without_stale(samples: Samples) -> Samples:
    """The recording without its stale rows, where there are not too few of them for a fault."""
    stale, _ = stale_rows(samples.recording)
    if stale.sum() < FEWEST:
        return samples
    angles = samples.angles.copy()
    angles[stale] = np.nan
    return replace(samples, angles=angles)


def with_uncertain_times(samples: Samples, jitter: float) -> Samples:
    """The recording when each row was taken at a time uncertain by so many s.

    A reading then counts for less the faster its disc turned: by the variance that the jitter
    adds to its rounding.
    """
    if jitter <= 0.0:
        return samples
    repeats = samples.repeats.copy()
    for place, name in enumerate(_NAMES):
        step = samples.recording.quanta.get(name, 0.0)
        if step > 0.0:
            speed = _speed(samples.angles[:, place], samples.t)
            repeats[:, place] *= 1.0 + (jitter * speed) ** 2 / (step**2 / 12.0)
    return replace(samples, repeats=repeats)


def _speed(angle: FloatArray, t: FloatArray) -> FloatArray:
    """Size of the velocity around each row, rad/s, shape (n,)."""
    known = np.isfinite(angle)
    whole = np.interp(t, t[known], angle[known])
    rows = np.arange(len(t))
    before = np.maximum(rows - _SPEED_REACH, 0)
    after = np.minimum(rows + _SPEED_REACH, len(t) - 1)
    return np.abs(whole[after] - whole[before]) / (t[after] - t[before])


def cleaned(samples: Sequence[Samples], jitter: float = 0.0) -> list[Samples]:
    """Recordings without stale rows and glitches, their times uncertain by `jitter` s."""
    return [with_uncertain_times(without_stale(without_glitches(s)), jitter) for s in samples]
