"""Numbers of what was found, from every reading of the windows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drill_env._types import IntArray
from drill_env._watch import never
from drill_env.prediction.cut import Cut
from drill_env.prediction.fit import Fit, fit


def refitted(found: Sequence[Fit], cuts: Sequence[Cut]) -> Fit:
    """One model fitted to every reading of the windows of some recordings.

    A few leads tell models apart, but leave most readings out; once a model is chosen, all of them
    tell its numbers. The mean of a window's log densities still counts it once.

    Args:
        found: fits of the model, of which the best place is taken to start from.
        cuts: the recordings.
    """
    dense = every_row(cuts)
    tried = (
        fit(replace(one.setting, cuts=dense, over=never), one.vector, one.candidates, one.numbers)
        for one in found
    )
    return max(tried, key=lambda there: there.value)


def every_row(cuts: Sequence[Cut]) -> tuple[Cut, ...]:
    """Recordings with windows that are predicted at all rows from the first lead to the last.

    Rows without a reading are left out, and as many from every window as the shortest of them has,
    spread over it evenly: then a lead is the same in all.

    Args:
        cuts: the recordings, each with windows at a few leads.
    """
    rows = [[_read(one, row) for row in one.windows.rows] for one in cuts]
    count = min(len(there) for windows in rows for there in windows)
    return tuple(
        _at(one, np.stack([_spread(there, count) for there in windows]))
        for one, windows in zip(cuts, rows, strict=True)
    )


def _read(one: Cut, row: IntArray) -> IntArray:
    """Rows with readings between the first and the last of a window's rows."""
    inside = np.arange(row[0], row[-1] + 1)
    return inside[np.isfinite(one.samples.angles[inside][:, : one.target.shape[2]]).all(axis=1)]


def _spread(rows: IntArray, count: int) -> IntArray:
    return rows[np.round(np.linspace(0, len(rows) - 1, count)).astype(np.int64)]


def _at(one: Cut, rows: IntArray) -> Cut:
    target = one.samples.angles[rows][..., : one.target.shape[2]]
    return replace(one, windows=replace(one.windows, rows=rows), target=target)
