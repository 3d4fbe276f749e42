"""What windows are run through: the held voltage cut at their ends, angles from before a delay."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from drill_env import Rig
from drill_env.effects.along import Motion, late_angles
from drill_env.effects.declared import declared
from drill_env.integrator.voltage import sampled_voltage
from drill_env.integrator.windows import Windows, _pieces

ROWS = 400


def some_motion(seed: int) -> Motion:
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.5e-2, 1.5e-2, ROWS))
    # Levels that stay for some rows, and equal ones side by side.
    u = np.repeat(rng.integers(-2, 3, ROWS // 5), 5).astype(np.float64)
    return Motion(t, u, rng.normal(size=(ROWS, 6)), np.array([0, 150]))


@pytest.mark.parametrize("shift", [0.0, 0.013, 0.31, -0.02])
def test_the_voltage_of_windows_is_the_held_one(shift: float):
    rng = np.random.default_rng(1)
    motion = some_motion(2)
    starts = np.arange(10, 300, 40)
    windows = Windows(motion, starts, starts[:, np.newaxis] + [3, 20, 60])
    breaks, pieces = _pieces(motion, windows, declared(Rig()), shift)
    t, held = motion.t, sampled_voltage(motion.t + shift, motion.u)
    assert (np.diff(breaks) > 0.0).all()
    assert len(pieces) == len(breaks) - 1
    assert np.isin(t[[0, -1, *starts, *windows.rows[:, -1]]], breaks).all()
    asked = rng.uniform(t[0], t[-1], 2000)
    # Where two rows' changes and an end lie within rounding, either side is right.
    asked = asked[np.abs(asked[:, np.newaxis] - breaks).min(axis=1) > 1e-9]
    found = pieces[np.searchsorted(breaks, asked, side="right") - 1, 0]
    assert found == pytest.approx(held(asked), abs=0.0)


def test_no_piece_of_a_constant_voltage_is_cut_but_at_the_ends():
    motion = some_motion(3)
    constant = Motion(motion.t, np.full(ROWS, 2.0), motion.states, motion.restarts)
    windows = Windows(constant, np.array([10, 90]), np.array([[20, 90], [100, 170]]))
    breaks, pieces = _pieces(constant, windows, declared(Rig()), -0.004)
    assert breaks == pytest.approx(motion.t[[0, 10, 90, 170, -1]], abs=0.0)
    assert (pieces == 2.0).all()


@pytest.mark.parametrize("rows", [None, np.array([0, 3, 151, 399])])
def test_late_angles_are_those_of_a_cubic_spline(rows: np.ndarray | None):
    motion, delay = some_motion(4), 0.023
    known = CubicHermiteSpline(motion.t, motion.angles, motion.states[:, 1:3])
    begin = np.where(np.arange(ROWS) < 150, motion.t[0], motion.t[150])
    expected = known(np.maximum(motion.t - delay, begin))
    expected = expected if rows is None else expected[rows]
    assert late_angles(motion, delay, rows) == pytest.approx(expected, abs=1e-12)
