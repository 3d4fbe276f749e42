"""What a diagnosis reads of recordings: no more than it can, and no less than it needs."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from drill_env._errors import InputError
from drill_env.diagnosis.held_out import HORIZON
from drill_env.recordings import Recording, RecordingWarning

MOST_ROWS = 100_000
"""Rows that are read, of all recordings together.

Every candidate's slopes are kept for each row: measured, these are 1.1 GB and 160 s of CPU.
Evidence is half the rows times the squared ratio of an effect to white noise: with so many, a
sixtieth of the noise has the 15 nats of a name.
"""


def bounded(
    recordings: Sequence[Recording], holdout: Sequence[Recording], most: int = MOST_ROWS
) -> tuple[list[Recording], list[Recording]]:
    """The first rows of long recordings, so that all together have no more than `most`.

    Short ones are read whole, and the longer ones up to one number of rows. They are not thinned:
    what is faster than half the rate would pose as something slow.

    Args:
        recordings: to fit.
        holdout: to judge by.
        most: rows.

    Raises:
        InputError: what is left of a recording is too short to be judged.
    """
    every = [*recordings, *holdout]
    longest = _longest([len(r) for r in every], most)
    kept = [_first(r, longest, most) if len(r) > longest else r for r in every]
    return kept[: len(recordings)], kept[len(recordings) :]


def _longest(lengths: Sequence[int], most: int) -> int:
    """The number of rows to which longer recordings are cut."""
    left = most
    for place, length in enumerate(sorted(lengths)):
        share = left // (len(lengths) - place)
        if length > share:
            return share
        left -= length
    return max(lengths, default=0)


def _first(recording: Recording, rows: int, most: int) -> Recording:
    part = recording.part(0, rows)
    told = (
        f"{recording.source}: a diagnosis reads {most} rows in all, of this recording the first "
        f"{rows} of {len(recording)}"
    )
    if rows < 2 or part.duration < HORIZON:
        seconds = part.duration if rows else 0.0
        raise InputError(
            f"{told}, which are {seconds:.3g} s, and needs {HORIZON:g} s; give fewer samples per "
            "second, or fewer recordings"
        )
    warnings.warn(
        RecordingWarning(
            "long",
            f"{told}, {part.duration:.4g} of {recording.duration:.4g} s; give the stretch that "
            "should be diagnosed, or fewer samples per second",
        ),
        stacklevel=3,
    )
    return part


def check_told(recordings: Sequence[Recording]) -> None:
    """Refuse recordings that are too short, and those in which no disc turns.

    Raises:
        InputError: naming the recording.
    """
    for recording in recordings:
        # The last row stands for an interval too.
        seconds = recording.duration * len(recording) / max(len(recording) - 1, 1)
        if seconds < (1.0 - 1e-9) * HORIZON:
            raise InputError(
                f"{recording.source}: {seconds:.3g} s are too short, diagnose needs "
                f"{HORIZON:g} s and more; record longer"
            )
    readings = [r[np.isfinite(r)] for one in recordings for r in one.readings().values()]
    if readings and not any(len(r) and np.ptp(r) for r in readings):
        raise InputError(
            f"{recordings[0].source}: no reading ever changes; record the rig while it turns"
        )
