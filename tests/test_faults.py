"""Faults of the recording itself are found and named: lost counts, bits, stale rows, clock."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.rig_maker import make, quasi_random
from drill_env import Rig
from drill_env.diagnosis.clock import stale_rows
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.faults import lost_bits
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.effects import LIBRARY
from drill_env.parameters import SYMBOLS
from drill_env.recordings import Recording

RATE, STEP = 200.0, 2 * math.pi / 8192
# A small library: but for lost counts, what is tested here is not in it.
KEPT = ("quadratic_drag", "missed_counts_upper", "missed_counts_lower")
OPTIONS = DiagnosisOptions(leave_out=tuple(n for n in LIBRARY if n not in KEPT), most=1)


@pytest.fixture(scope="module")
def made():
    truth = {name: getattr(Rig(), name) for name in SYMBOLS}
    u = quasi_random(np.random.default_rng(4), 25.0, RATE, 5.0)
    return make(truth, u, RATE, seed=9, counts=8192, torque_u=0.02, torque_l=2e-4)


def diagnosed(made, theta_u, theta_l, step_l=STEP):
    quanta = {"theta_u": STEP, "theta_l": step_l}
    recording = Recording(made.t, made.u, theta_u, theta_l, quanta=quanta)
    return diagnose([recording], Rig(), options=OPTIONS).result


def test_a_sound_recording_has_no_fault(made):
    result = diagnosed(made, made.theta_u, made.theta_l)
    assert result.verdict == "consistent" and result.faults == []


def test_counts_lost_at_single_moments(made):
    lost = made.theta_l.copy()
    for row in (1500, 2600, 3900):
        lost[row:] -= 6 * STEP
    result = diagnosed(made, made.theta_u, lost)
    assert [effect.id for effect in result.effects] == ["missed_counts_lower"]
    numbers = result.effects[0].parameters
    assert numbers["size"].value == pytest.approx(6 * STEP, rel=0.01)
    assert numbers["rate"].value == pytest.approx(3 / 25.0, rel=0.01)


@pytest.mark.parametrize("counts, whole", [(4.0, True), (4.5, False)])
def test_an_encoder_loses_whole_counts(made, counts, whole):
    """One step alone is believed if it is whole; anything else on the reading may look so."""
    lost = made.theta_l.copy()
    lost[2600:] -= counts * STEP
    result = diagnosed(made, made.theta_u, lost)
    assert any(e.id == "missed_counts_lower" for e in result.effects) == whole


def test_a_coarser_encoder_has_lost_bits(made):
    coarse = np.floor(made.theta_l / (4 * STEP)) * 4 * STEP
    result = diagnosed(made, made.theta_u, coarse, 4 * STEP)
    effect = next(e for e in result.effects if e.id == "lost_encoder_bits")
    assert effect.parameters["bits"].value == 2.0


@pytest.mark.parametrize(
    ("rig", "stated", "sure"),
    [
        (Rig(), {}, True),
        # Another rig may have any two encoders.
        (Rig(Jl=4.0 * Rig().Jl), {}, False),
        (Rig(Jl=4.0 * Rig().Jl), {"theta_u": STEP, "theta_l": STEP}, True),
        (Rig(), {"theta_u": STEP, "theta_l": 2 * STEP}, None),
    ],
)
def test_unlike_encoders_have_lost_bits_only_where_they_ought_to_be_alike(made, rig, stated, sure):
    quanta = {"theta_u": STEP, "theta_l": 2 * STEP}
    recording = Recording(made.t, made.u, made.theta_u, made.theta_l, quanta=quanta, stated=stated)
    fault = lost_bits([recording], rig)
    assert (None if fault is None else fault.sure) == sure


def test_a_disc_that_turns_back_repeats_no_row():
    """A flexible link swings by many counts a row; where both ends turn back readings repeat."""
    t = np.arange(5000) / 250.0
    swing = np.round(0.3 * np.cos(2 * math.pi * 2.0 * t) / STEP) * STEP
    still = np.zeros_like(t)
    quanta = {"theta_u": STEP, "theta_l": STEP}
    assert (np.diff(swing) == 0.0).any()
    sound = Recording(t, still, still, swing, quanta=quanta)
    assert not stale_rows(sound)[0].any()
    fast = np.flatnonzero(np.abs(swing) < 0.1)[5:25:5]
    swing[fast] = swing[fast - 1]
    lost = Recording(t, still, still, swing, quanta=quanta)
    np.testing.assert_array_equal(np.flatnonzero(stale_rows(lost)[0]), fast)


@pytest.mark.parametrize("lost", [0, 12])
def test_a_disc_that_sticks_for_a_moment_repeats_no_row(lost):
    """A fine encoder counts many a row beside a short rest; lost rows are made up for after it."""
    t, step = np.arange(8000) / 200.0, 2 * math.pi / 4e6
    # It comes to rest once a second, stands for 20 ms and goes on.
    speed = np.maximum(1.0 + 1.01 * np.cos(2 * math.pi * t), 0.0)
    angle = np.round(np.cumsum(speed) / 200.0 / step) * step
    both = np.column_stack([angle, angle])
    assert repeats(both).sum() > 100
    rows = 50 + 600 * np.arange(1, lost + 1)
    assert not repeats(both)[rows].any()
    both[rows] = both[rows - 1]
    recording = Recording(
        t, np.zeros_like(t), *both.T, quanta={"theta_u": step, "theta_l": step}
    )  # fmt: skip
    told = np.flatnonzero(stale_rows(recording)[0])
    assert set(told) >= set(rows) if lost else not len(told)


def repeats(values):
    """Rows at which both encoders show what they showed before, shape (n,), none at the ends."""
    same = np.zeros(len(values), dtype=bool)
    same[12:-12] = (np.diff(values, axis=0) == 0.0).all(axis=1)[11:-12]
    return same


@pytest.mark.parametrize("repeated", [0, 30])
def test_noise_of_several_counts_repeats_rows_by_chance(repeated):
    """Both encoders show the same count twice running in a few of so many rows."""
    rng = np.random.default_rng(2)
    t = np.arange(15_000) / 200.0
    values = np.column_stack([1600.0 * t, 1600.0 * t + 90.0 * np.sin(t)])
    values = np.round(values + rng.normal(0.0, 6.0, values.shape)) * STEP
    chance = repeats(values)
    rows = rng.choice(np.arange(20, len(t) - 20), repeated, replace=False)
    values[rows] = values[rows - 1]
    recording = Recording(
        t, np.zeros_like(t), *values.T, quanta={"theta_u": STEP, "theta_l": STEP}
    )  # fmt: skip
    assert chance.sum() >= 5
    told = np.flatnonzero(stale_rows(recording)[0])
    expected = np.flatnonzero(repeats(values)) if repeated else []
    np.testing.assert_array_equal(told, expected)


def test_rows_that_repeat_the_row_before(made):
    theta_u, theta_l = made.theta_u.copy(), made.theta_l.copy()
    fast = np.flatnonzero(np.abs(np.gradient(theta_l, made.t)) > 6.0)[::150]
    for later in range(4):
        rows = fast + later
        theta_u[rows], theta_l[rows] = theta_u[fast - 1], theta_l[fast - 1]
    result = diagnosed(made, theta_u, theta_l)
    # Left out, they are not taken for physics.
    assert [effect.id for effect in result.effects] == ["missing_samples"]
    moving = np.abs(np.gradient(made.theta_l, made.t)) > 1.0
    share = result.effects[0].parameters["share"].value
    assert share == pytest.approx(4 * len(fast) / moving.sum(), rel=0.2)


def test_uncertain_times(made):
    rng = np.random.default_rng(0)
    late = rng.normal(0.0, 3e-4, len(made.t))
    theta_u, theta_l = (
        np.round((theta + np.gradient(theta, made.t) * late) / STEP) * STEP
        for theta in (made.theta_u, made.theta_l)
    )
    result = diagnosed(made, theta_u, theta_l)
    assert [effect.id for effect in result.effects] == ["clock_jitter"]
    jitter = result.effects[0].parameters["jitter"]
    assert jitter.value == pytest.approx(3e-4, rel=0.1)
