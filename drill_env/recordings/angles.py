"""Checks of the encoder channels: counts, wraps, jumps, dead or clipped encoders."""

from __future__ import annotations

import math

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.recordings.checks import Place, longest_run
from drill_env.recordings.limits import LARGEST_SPAN
from drill_env.recordings.recording import RecordingWarning, is_gap

_TURN = 2.0 * math.pi
_FASTEST = 100.0
_LINEAR = ("m", "mm", "um")


def check_angle(
    t: FloatArray, theta: FloatArray, place: Place
) -> tuple[FloatArray, float | None, list[RecordingWarning]]:
    """Check one angle channel and unwrap it where it wraps.

    Args:
        t: times in s, shape (n,).
        theta: angles in rad, shape (n,).
        place: where they came from.

    Returns:
        The unwrapped angles in rad, the encoder step in rad where visible, the remarks.

    Raises:
        InputError: the channel holds counts and no unit was stated.
    """
    if np.all(theta == theta[0]):
        note = RecordingWarning(
            "constant",
            f"{place} never changes from {theta[0]:.6g}: the encoder is dead or the disc stood "
            "still all the time",
        )
        return theta, None, [note]
    _refuse_counts(theta, place)
    step = encoder_step(theta, t)
    theta, notes = _unwrap(t, theta, step, place)
    _refuse_span(theta, place)
    notes += _clipped(theta, place)
    notes += _speed(t, theta, place)
    return theta, step, notes


def _refuse_counts(theta: FloatArray, place: Place) -> None:
    if place.column.stated or np.any(theta != np.round(theta)) or len(np.unique(theta)) < 10:
        return
    raise InputError(
        f"{place} holds whole numbers ({theta.min():.0f} to {theta.max():.0f}), which look like "
        f"encoder counts; state the counts per turn: {place.mapped('counts/8192')} "
        f"(or {place.mapped('rad')} if it is in rad)"
    )


def _refuse_span(theta: FloatArray, place: Place) -> None:
    if np.ptp(theta) > LARGEST_SPAN:
        i = int(np.argmax(np.abs(theta - np.median(theta))))
        raise InputError(
            f"{place} goes from {theta.min():.4g} to {theta.max():.4g} (farthest in row "
            f"{place.row(i)}), further than {LARGEST_SPAN:g}; cut that row out, or mend the unit: "
            f"{place.mapped('UNIT')}"
        )


def encoder_step(theta: FloatArray, t: FloatArray | None = None) -> float | None:
    """The step between neighbouring encoder positions (rad), None where none is visible.

    Args:
        theta: angles in rad, shape (n,), as recorded.
        t: times in s, shape (n,); moves across gaps are then left out.
    """
    moves = np.abs(np.diff(theta))
    if t is not None:
        moves = moves[~is_gap(t)]
    moves = np.sort(moves[moves > 1e-12 * max(1.0, float(np.abs(theta).max()))])
    if len(moves) < 20:
        return None
    for candidates in (moves, _differences(moves)):
        if len(candidates) == 0:
            continue
        step = _refined(float(np.median(candidates[candidates <= 1.5 * candidates[0]])), moves)
        if step is not None:
            digits = math.log10(step)
            # A power of ten is the rounding of the file, not the encoder.
            return None if abs(digits - round(digits)) < 1e-3 else step
    return None


def _differences(moves: FloatArray) -> FloatArray:
    """Differences between the sizes of move, sorted: a fast disc never moves by single counts."""
    gaps = np.diff(moves)
    groups = np.split(moves, np.flatnonzero(gaps > 0.2 * gaps.max()) + 1)
    return np.sort(np.diff([float(group.mean()) for group in groups]))


def _refined(step: float, moves: FloatArray) -> float | None:
    # Small multiples first: their rounding is told apart surely, and they sharpen the step.
    for limit in (20.0, 1e3, 1e5, math.inf):
        near = moves[moves <= limit * step]
        if len(near) == 0:
            continue
        multiples = np.round(near / step)
        if np.mean(np.abs(near / step - multiples) < 0.1) < 0.99:
            return None
        step = float(near @ multiples / (multiples @ multiples))
    # Fewer than three sizes of move are multiples of almost anything.
    return step if moves[-1] - moves[0] > 1.5 * step else None


def _unwrap(
    t: FloatArray, theta: FloatArray, step: float | None, place: Place
) -> tuple[FloatArray, list[RecordingWarning]]:
    # A disc may turn far while rows are missing.
    moves = np.where(is_gap(t), 0.0, np.diff(theta))
    usual = float(np.quantile(np.abs(moves), 0.99))
    jumps = np.flatnonzero(np.abs(moves) > max(20.0 * usual, 0.5 * np.ptp(theta) / 10.0))
    wrapped = np.flatnonzero(np.abs(moves) > 0.75 * _TURN)
    # A fast disc makes wraps frequent, so that they are no outliers among the moves.
    if np.ptp(theta) <= 1.01 * _TURN and len(wrapped) > len(jumps):
        jumps = wrapped
        usual = float(np.quantile(np.abs(np.delete(moves, wrapped)), 0.99))
    if len(jumps) == 0:
        return theta, []
    sizes = np.abs(moves[jumps])
    for period, name in _periods(step, place):
        if np.all(np.abs(sizes - period) < max(3.0 * usual, 0.02 * period)):
            note = RecordingWarning(
                "wrapped", f"{place} wraps {len(jumps)} times at {name}; unwrapped"
            )
            return np.unwrap(theta, period=period), [note]
    i = int(jumps[0])
    note = RecordingWarning(
        "jump",
        f"{place} jumps {len(jumps)} times, first by {moves[i]:.4g} in row {place.row(i + 1)}; "
        "that is no full turn or counter range: cut the recording there or mend the encoder",
    )
    return theta, [note]


def _periods(step: float | None, place: Place) -> list[tuple[float, str]]:
    linear = place.column.unit in _LINEAR
    periods = [] if linear else [(_TURN, "a full turn")]
    count = place.column.scale if place.column.turn else step
    if count is not None:
        bits = (8, 10, 12, 14, 16, 20, 24, 32)
        periods += [(count * 2.0**b, f"a counter range of 2^{b}") for b in bits]
    return periods


def _clipped(theta: FloatArray, place: Place) -> list[RecordingWarning]:
    moves = np.abs(np.diff(theta))
    moving = moves[moves > 0.0]
    if len(moving) == 0:
        return []
    notes = []
    for name, level in (("maximum", theta.max()), ("minimum", theta.min())):
        start, length = longest_run(theta == level)
        # A disc slows down before it stops; a counter at its end stops in full motion.
        entry = moves[start - 2] if start > 1 else 0.0
        if length >= 5 and entry > 0.5 * np.median(moving) + 1e-4 * np.ptp(theta):
            notes.append(
                RecordingWarning(
                    "saturated",
                    f"{place} stops dead at its {name} {level:.6g} in row {place.row(start)} for "
                    f"{length} samples: the counter seems to have reached its end",
                )
            )
    return notes


def _speed(t: FloatArray, theta: FloatArray, place: Place) -> list[RecordingWarning]:
    if place.column.stated:
        return []
    # Over 50 ms, so that the encoder's own steps do not count as speed.
    stride = max(1, round(0.05 * (len(t) - 1) / (t[-1] - t[0])))
    if stride >= len(t):
        return []
    speeds = np.abs((theta[stride:] - theta[:-stride]) / (t[stride:] - t[:-stride]))
    fastest = float(np.quantile(speeds, 0.99))
    if fastest <= _FASTEST:
        return []
    return [
        RecordingWarning(
            "implausible_speed",
            f"{place} turns at up to {fastest:.4g} rad/s, too fast for this rig; if it is in "
            f"degrees state so: {place.mapped('deg')}",
        )
    ]
