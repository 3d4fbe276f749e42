"""Channels that have a clock of their own, put on the rows of one recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.recordings.checks import SHORTEST, check_length
from drill_env.recordings.recording import Recording, RecordingWarning, is_gap
from drill_env.recordings.units import LOADS, Channel

# Of the usual interval: the jitter of a single clock is remarked from there on.
_NEAR = 0.01


def on_rows(
    recording: Recording,
    others: Mapping[Channel, tuple[FloatArray, FloatArray]],
    *,
    interpolate: bool,
) -> Recording:
    """A recording with more channels, or channels anew, from other clocks.

    Its rows stay, but for those in which the drive or a load is then not known. The drive gets its
    mean over each row, since it is held on its own clock, and where the bridge is switched within a
    row, that is not known; a load is straight between its samples. A reading gets the sample that
    stands at the row, within 1 % of the usual interval, and is else missing, or interpolated if
    that is asked for.

    Args:
        recording: gives the rows.
        others: times (s) and values by channel, `u` for a torque too.
        interpolate: straight lines between samples next to each other.

    Raises:
        InputError: fewer than ten rows or samples of a reading are left.
    """
    values = recording.channels()
    t = values.pop("t")
    notes: list[RecordingWarning] = []
    for name, (clock, column) in others.items():
        if name == "u":
            values[name] = held(t, clock, column)
        elif name == "bridge":
            share = held(t, clock, column)
            whole = np.round(share)
            values[name] = np.where(np.abs(share - whole) <= _NEAR, whole, np.nan)
        elif name in LOADS:
            values[name] = _straight(t, clock, column)
        else:
            values[name] = sampled(t, clock, column, interpolate=interpolate)
            notes += _remarks(recording.source, name, values[name], t, (clock, column), interpolate)
    must = [values[name] for name in ("u", "bridge", *LOADS) if name in values]
    known = np.isfinite(must).all(axis=0) if must else np.full(len(t), True)
    check_length(t[known], recording.source)
    if not known.all():
        lost = int((~known).sum())
        text = f"{recording.source}: the drive or a load is not known in {lost} rows; left out"
        notes.append(RecordingWarning("clocks", text))
    return replace(
        recording, t=t[known], **{name: column[known] for name, column in values.items()},
        extra={name: column[known] for name, column in recording.extra.items()},
        notes=(*recording.notes, *notes),
    )  # fmt: skip


def sampled(
    t: FloatArray, clock: FloatArray, values: FloatArray, *, interpolate: bool
) -> FloatArray:
    """Readings at other times: those that stand there, else NaN.

    Args:
        t: times of the rows (s), shape (n,).
        clock: times of the readings (s), ascending, shape (m,).
        values: readings, shape (m,).
        interpolate: on a straight line where the samples on both sides are next to each other.

    Returns:
        Readings on the rows, shape (n,).
    """
    after = np.clip(np.searchsorted(clock, t), 1, len(clock) - 1)
    nearest = after - (t - clock[after - 1] < clock[after] - t)
    near = np.abs(clock[nearest] - t) <= _NEAR * float(np.median(np.diff(t)))
    found = np.where(near, values[nearest], np.nan)
    if interpolate:
        inside = ~near & (clock[0] < t) & (t < clock[-1]) & ~is_gap(clock)[after - 1]
        found[inside] = np.interp(t[inside], clock, values)
    return found


def _straight(t: FloatArray, clock: FloatArray, values: FloatArray) -> FloatArray:
    """Values on straight lines between samples next to each other, NaN elsewhere, shape (n,)."""
    found = np.interp(t, clock, values, left=np.nan, right=np.nan)
    after = np.clip(np.searchsorted(clock, t), 1, len(clock) - 1)
    found[is_gap(clock)[after - 1]] = np.nan
    return found


def held(t: FloatArray, clock: FloatArray, u: FloatArray) -> FloatArray:
    """Mean over each row of a drive that is held on its own clock, shape (n,).

    The mean gives the same impulse. NaN where the drive is not known all the row: before its first
    sample, more than a usual interval behind its last one, and in its gaps.

    Args:
        t: times of the rows (s), shape (n,).
        clock: times at which the drive changes (s), ascending, shape (m,).
        u: the drive from then on, shape (m,).
    """
    if np.array_equal(t, clock):
        return u
    row, usual = float(np.median(np.diff(t))), float(np.median(np.diff(clock)))
    # A value before a gap is held for a usual interval too, and what follows is not known.
    gaps = np.flatnonzero(is_gap(clock))
    edges = np.append(np.insert(clock, gaps + 1, clock[gaps] + usual), clock[-1] + usual)
    u = np.insert(u, gaps + 1, np.nan)
    lost = ~np.isfinite(u)
    begins, ends = t, np.minimum(np.append(t[1:], t[-1] + row), t + 1.8 * row)
    slack = _NEAR * min(row, usual)
    outside = (begins < edges[0] - slack) | (ends > edges[-1] + slack)
    begins, ends = np.clip(begins, edges[0], edges[-1]), np.clip(ends, edges[0], edges[-1])

    def over_rows(steps: FloatArray) -> FloatArray:
        total = np.concatenate([[0.0], np.cumsum(steps * np.diff(edges))])
        return np.interp(ends, edges, total) - np.interp(begins, edges, total)

    unknown = outside | (over_rows(lost.astype(float)) > slack)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(unknown, np.nan, over_rows(np.where(lost, 0.0, u)) / (ends - begins))


def _remarks(
    source: str,
    name: Channel,
    found: FloatArray,
    t: FloatArray,
    given: tuple[FloatArray, FloatArray],
    interpolate: bool,
) -> list[RecordingWarning]:
    clock, values = given
    direct = np.isfinite(sampled(t, clock, values, interpolate=False))
    count, kept = int(np.isfinite(values).sum()), int(direct.sum())
    if np.isfinite(found).sum() < SHORTEST:
        raise InputError(
            f"{source}: {kept} of the {count} samples of {name} stand at a time of the recording's "
            "rows; check clock and delay, or state interpolate = true in recordings.toml for "
            "straight lines between its samples"
        )
    between = int(np.isfinite(found).sum()) - kept
    if interpolate and between:
        text = (
            f"{source}: {name} is interpolated in {between} of {len(t)} rows; its noise is then "
            "less and not white, and intervals are somewhat too narrow"
        )
        return [RecordingWarning("interpolated", text)]
    within = int((np.isfinite(values) & (t[0] <= clock) & (clock <= t[-1])).sum())
    if kept >= within:
        return []
    text = (
        f"{source}: {within - kept} of {within} samples of {name} stand at no row's time and are "
        "passed over; record with one clock, or state interpolate = true in recordings.toml"
    )
    return [RecordingWarning("clocks", text)]
