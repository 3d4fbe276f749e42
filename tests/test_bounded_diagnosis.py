"""A diagnosis of a million rows reads as many as it can, and says which."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from drill_env import InputError
from drill_env.diagnosis.bounded import MOST_ROWS, bounded
from drill_env.recordings import Recording, RecordingWarning


def recording(rows: int, rate: float = 100.0, source: str = "a.csv") -> Recording:
    t = np.arange(rows) / rate
    return Recording(t, t, t, source=source)


def test_a_million_rows_are_cut_to_the_first_and_short_ones_are_whole():
    long, short = recording(1_000_000), recording(2_000, source="b.csv")
    with pytest.warns(RecordingWarning, match=r"^a\.csv: .* the first 98000 of 1000000") as told:
        fit, held = bounded([long], [short])
    assert len(told) == 1
    assert [len(r) for r in fit] == [98_000] and held[0] is short
    assert fit[0].t[0] == 0.0 and fit[0].interval == pytest.approx(0.01)


def test_long_ones_are_cut_alike():
    lengths = (60_000, 10_000, 80_000)
    with pytest.warns(RecordingWarning):
        fit, _ = bounded([recording(n) for n in lengths], [])
    assert [len(r) for r in fit] == [45_000, 10_000, 45_000]


def test_what_fits_is_left_alone():
    given = [recording(MOST_ROWS // 4) for _ in range(4)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fit, held = bounded(given[:3], given[3:])
    assert all(a is b for a, b in zip([*fit, *held], given, strict=True))


def test_a_stretch_too_short_to_judge_is_one_error():
    with pytest.raises(InputError, match="100000 of 1000000, which are 1 s.*fewer samples"):
        bounded([recording(1_000_000, rate=1e5)], [])
    with pytest.raises(InputError, match="fewer samples per second, or fewer recordings"):
        bounded([recording(1000) for _ in range(400)], [])
