"""A reading that is off alone is no reading; knocks, lost counts and rounding are none of these."""

from __future__ import annotations

import numpy as np
import pytest

from drill_env.diagnosis.glitches import glitches

T = np.arange(4000) / 200.0
STEP = 2.0 * np.pi / 2000.0
WAY = 3.0 * T + np.sin(2.0 * T)


def rounded(values):
    return STEP * np.round(values / STEP)


@pytest.mark.parametrize("noise", [0.0, 3e-3])
def test_readings_that_jump_there_and_back_are_found_and_no_other(noise):
    rng = np.random.default_rng(5)
    rows = rng.choice(np.arange(2, len(T) - 2, 7), 12, replace=False)
    values = WAY + noise * rng.standard_normal(len(T))
    values[rows] += rng.choice([-1.0, 1.0], 12) * rng.uniform(0.1, 0.5, 12)
    found = np.flatnonzero(glitches(T, rounded(values), STEP))
    assert found.tolist() == np.sort(rows).tolist()


@pytest.mark.parametrize(
    "way",
    [
        WAY + 0.3 * (T > 10.0),  # counts that were lost
        WAY + 60.0 * np.maximum(T - 10.0, 0.0),  # a knock: the speed jumps
        WAY + 0.3 * (T > 10.0) * (T < 10.012),  # off for two rows: a fault, and no single reading
        np.sin(2.0 * np.pi * 90.0 * T),  # nearly as fast as it is sampled
        np.zeros_like(T),  # at rest
    ],
)
def test_what_a_machine_or_a_counter_does_is_no_glitch(way):
    assert not glitches(T, rounded(way), STEP).any()


def test_missing_and_uneven_rows_are_no_glitches():
    rng = np.random.default_rng(6)
    t = np.cumsum(rng.uniform(0.002, 0.008, 4000))
    values = rounded(20.0 * np.sin(0.5 * t))
    values[rng.choice(4000, 200, replace=False)] = np.nan
    assert not glitches(t, values, STEP).any()
