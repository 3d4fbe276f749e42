"""Checks of a recording's time base, and what every channel shares."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from drill_env._errors import InputError
from drill_env._types import BoolArray, FloatArray
from drill_env.recordings.columns import Column
from drill_env.recordings.limits import (
    LARGEST,
    LONGEST_DURATION,
    MOST_ROWS,
    SHORTEST_INTERVAL,
)
from drill_env.recordings.recording import RecordingWarning, is_gap
from drill_env.recordings.units import Channel

SHORTEST = 10
"""Rows below which nothing can be estimated."""

_JITTER = 0.01
_SLOW, _SLOWEST = 0.06, 0.25
_HUGE = 1e15
_TIME_NAMES = {"ms": r"ms|msec|milli\w*", "us": r"us|usec|micro\w*", "ns": r"ns|nsec|nano\w*"}


@dataclass(frozen=True, slots=True)
class Place:
    """Where a channel came from, for messages.

    Attributes:
        source: the file.
        channel: the channel.
        column: its column in the file.
        first_row: number of the first data row in the file.
    """

    source: str
    channel: Channel
    column: Column
    first_row: int = 1

    def __str__(self) -> str:
        name = self.column.name
        alias = "" if name == self.channel else f" ({self.channel})"
        return f"{self.source}: column {name}{alias}"

    def row(self, index: int | np.integer) -> int:
        """The file's row number of sample `index`."""
        return int(index) + self.first_row

    def mapped(self, unit: str) -> str:
        """The option that states a unit for this channel."""
        return f"--map {self.channel}={self.column.name}:{unit}"


def check_finite(values: FloatArray, place: Place) -> None:
    """Refuse NaN, infinity and what only a fault can have written.

    Raises:
        InputError: with the first bad row, and whether the file looks truncated.
    """
    check_huge(values, place)
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad) == 0:
        return
    if len(bad) == 1 and bad[0] == len(values) - 1:
        raise InputError(
            f"{place} has no number in the last row ({place.row(bad[0])}): the file looks "
            "truncated; delete that row or copy the file again"
        )
    raise InputError(
        f"{place} has {len(bad)} missing, NaN or infinite values, the first in row "
        f"{place.row(bad[0])}; cut those rows out or fill them, or read with "
        'missing = "keep" (in recordings.toml)'
    )


def check_huge(values: FloatArray, place: Place) -> None:
    """Refuse numbers that no channel can hold; NaN passes.

    Raises:
        InputError: with the first such row.
    """
    bad = np.flatnonzero(np.isfinite(values) & (np.abs(values) > _HUGE))
    if len(bad):
        raise InputError(
            f"{place} holds {values[bad[0]]:.3g} in row {place.row(bad[0])}, a fault of the "
            f"recording ({len(bad)} such rows); cut those rows out"
        )


def check_size(values: FloatArray, raw: FloatArray, place: Place) -> None:
    """Refuse sizes that no rig can have, in SI units; NaN passes.

    Args:
        values: in SI units, shape (n,).
        raw: the same as the file has them.
        place: where they came from.

    Raises:
        InputError: with the first such row.
    """
    most, unit = LARGEST[place.channel]
    bad = np.flatnonzero(np.isfinite(raw) & ~(np.abs(values) <= most))
    if len(bad):
        raise InputError(
            f"{place} holds {raw[bad[0]]:.3g} in row {place.row(bad[0])}, beyond {most:g} {unit} "
            f"({len(bad)} such rows); cut those rows out or mend the unit: {place.mapped('UNIT')}"
        )


def the_number(values: FloatArray, place: Place) -> float:
    """What a column holds in every row; NaN passes.

    Raises:
        InputError: it holds several numbers, or none.
    """
    found = np.unique(values[np.isfinite(values)])
    if len(found) != 1:
        raise InputError(
            f"{place} is not one number but {len(found)}; give the number itself: "
            f"--map {place.channel}=0.01"
        )
    return float(found[0])


def check_length(t: FloatArray, source: str) -> None:
    """Refuse recordings too short for anything.

    Raises:
        InputError: fewer than ten rows.
    """
    if len(t) < SHORTEST:
        raise InputError(
            f"{source}: only {len(t)} rows, at least {SHORTEST} are needed; "
            "the file is empty or truncated, record or export it again"
        )


def check_time(t: FloatArray, place: Place) -> list[RecordingWarning]:
    """Check the time base.

    Args:
        t: times in s, finite, shape (n,).
        place: where they came from.

    Raises:
        InputError: times repeat or run backwards, or the clock is not in seconds.
    """
    steps = np.diff(t)
    bad = np.flatnonzero(steps <= 0.0)
    if len(bad):
        i = int(bad[0])
        what = "repeats" if steps[i] == 0.0 else "runs backwards"
        raise InputError(
            f"{place} {what} in row {place.row(i + 1)} ({t[i]:.9g} then {t[i + 1]:.9g} s, "
            f"{len(bad)} such rows in all); sort the rows, drop repeats or "
            "export the time with more digits"
        )
    median = float(np.median(steps))
    _check_clock(median, place)
    _check_span(float(t[-1] - t[0]), median, place)
    notes = []
    if median > _SLOW and not place.column.stated:
        notes.append(
            RecordingWarning(
                "slow_clock",
                f"{place}: {median:.4g} s between samples is slow for this rig; if the clock is "
                f"not in seconds state its unit: {place.mapped('ms')}",
            )
        )
    return notes + _regularity(t, steps, median, place)


def _check_clock(median: float, place: Place) -> None:
    if place.column.stated:
        return
    words = re.split(r"[^a-z]+", place.column.name.lower())
    for unit, pattern in _TIME_NAMES.items():
        if any(re.fullmatch(pattern, word) for word in words):
            raise InputError(
                f"{place} is named as if in {unit}; state the unit: {place.mapped(unit)} "
                f"(or {place.mapped('s')} if it is in seconds)"
            )
    if median > _SLOWEST:
        unit = "ms" if median < 500.0 else "us" if median < 5e5 else "ns"
        raise InputError(
            f"{place} steps by {median:.6g}, which as seconds is too slow for this rig; the clock "
            f"is probably in {unit}: {place.mapped(unit)} (or {place.mapped('s')} if it is not)"
        )


def _check_span(duration: float, median: float, place: Place) -> None:
    if median < SHORTEST_INTERVAL:
        raise InputError(
            f"{place} steps by {median:.3g} s, which is shorter than any recorder's "
            f"{SHORTEST_INTERVAL:g} s; mend the clock or its unit: {place.mapped('UNIT')}"
        )
    if duration > LONGEST_DURATION or duration > MOST_ROWS * median:
        raise InputError(
            f"{place} covers {duration:.4g} s in steps of {median:.4g} s, more than "
            f"{LONGEST_DURATION:g} s or {MOST_ROWS:.0e} steps; cut it at its longest gap, or mend "
            f"the clock or its unit: {place.mapped('UNIT')}"
        )


def _regularity(
    t: FloatArray, steps: FloatArray, median: float, place: Place
) -> list[RecordingWarning]:
    notes = []
    gaps = is_gap(t)
    if gaps.any():
        i = int(np.flatnonzero(gaps)[0])
        lost = float(np.round(steps[gaps] / median - 1.0).sum())
        notes.append(
            RecordingWarning(
                "gap",
                f"{place}: {int(gaps.sum())} gaps, about {lost:.0f} samples lost, the first at "
                f"{t[i]:.6g} s (row {place.row(i)}), the longest {steps.max():.4g} s; the voltage "
                "is taken as held across them",
            )
        )
    jitter = float(np.sqrt(np.mean((steps[~gaps] / median - 1.0) ** 2)))
    if jitter > _JITTER:
        notes.append(
            RecordingWarning(
                "jitter",
                f"{place}: sampling jitter {100 * jitter:.1f} % rms of the {median:.6g} s interval "
                f"({1e3 * steps.min():.4g} to {1e3 * steps[~gaps].max():.4g} ms)",
            )
        )
    return notes


def longest_run(flags: BoolArray) -> tuple[int, int]:
    """Start and length of the longest stretch of true flags."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    starts, lengths = edges[::2], edges[1::2] - edges[::2]
    if len(starts) == 0:
        return 0, 0
    best = int(np.argmax(lengths))
    return int(starts[best]), int(lengths[best])
