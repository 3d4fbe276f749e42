"""Runs that go on in the middle of a motion remember what its effects had seen."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.effects_reference.settings import MOVING, entry
from drill_env.diagnosis.late_readings import on_time, telling
from drill_env.effects.along import Motion, inner_states
from drill_env.effects.steady import acting
from drill_env.integrator import Voltage, simulate
from drill_env.integrator.windows import Windows, resume
from drill_env.parameters import Rig
from tests.made_recordings import played

_EFFECTS = {
    "motor_heating": {"loss": 0.2, "time_constant": 8.0},
    "string_creep": {"compliance": 0.2, "time_constant": 5.0},
    "string_hysteresis": {"torque": 0.02, "width": 0.3},
    "wear": {"loss": 0.3, "distance": 100.0},
    "friction_lag": {"time_constant": 0.1},
    "actuator_lag": {"time_constant": 0.3},
    "input_delay": {"delay": 0.13},
    "slew_limit": {"rate": 3.0},
    "encoder_delay_lower": {"delay": 0.0825},
    "encoder_delay_upper": {"delay": 0.03},
    "missed_counts_lower": {"share": 0.05, "speed": 1.0},
    "encoder_play_lower": {"error": 0.02, "width": 0.01},
}
_T = np.arange(4001) * 0.005


def _motion(rig: Rig, u: np.ndarray) -> tuple[Motion, np.ndarray]:
    states, readings = played(rig, _T, u, np.array([0.3, 2.0, 2.0, 0.0]))
    rates = np.gradient(states[:, 1:3], _T, axis=0)
    return Motion(_T, u, np.hstack([states, rates]), np.array([0])), readings


@pytest.mark.parametrize("name", list(_EFFECTS))
def test_a_run_goes_on_as_if_it_had_not_been_cut(name):
    rig = Rig().replace(effects=({"id": name, **_EFFECTS[name]},))
    u = 3.0 + 1.2 * np.sign(np.sin(0.9 * _T)) + 0.3 * np.sin(2.2 * _T)
    motion, readings = _motion(rig, u)
    row = 2130
    part = slice(row, row + 800)
    inner = inner_states(acting(rig), motion, np.array([row]))[0]
    on = resume(rig, motion, part, inner).readings
    _, anew = played(rig, _T[part], u[part], motion.states[row, :4])
    gap = np.abs(on - readings[part]).max()
    # The motion between its samples is taken as straight.
    assert gap < 1e-3
    # Missed counts are lost for good, which a run that begins anew does not know.
    assert np.abs(anew - readings[part]).max() > 10.0 * gap


@pytest.mark.parametrize("name", MOVING)
def test_a_run_goes_on_from_its_own_states_wherever_it_is_cut(name):
    """Also where a motor is in balance with its own friction, which is none that rests."""
    rig = Rig(effects=(entry(name),))
    u = 2.0 * np.sin(1.3 * _T) + 0.7 * np.sign(np.sin(0.9 * _T)) + 0.4 * np.sin(7.0 * _T)
    t, u = _T[:2001], u[:2001]
    run = simulate(
        rig, Voltage(t, u[:-1, None]), float(t[-1]), t_eval=t, method="dopri5", rtol=1e-9,
        atol=1e-11, initial=np.array([0.3, 2.0, 2.0, 0.0]),
    )  # fmt: skip
    motion = Motion(t, u, np.hstack([run.state, np.zeros((len(t), 2))]), np.array([0]))
    starts = np.arange(150, 1900, 90)
    for row in starts.tolist():
        part = slice(row, row + 60)
        on = resume(rig, motion, part, run.inner[row]).states
        np.testing.assert_allclose(on[:, :3], run.state[part, :3], atol=1e-4)
    windows = Windows(motion, starts, starts[:, None] + [5, 59], inner=run.inner[starts])
    on = windows.predicted(rig).states
    np.testing.assert_allclose(on[..., :3], run.state[windows.rows, :3], atol=1e-4)


def test_memories_are_cleared_at_a_gap():
    rig = Rig().replace(effects=({"id": "wear", "loss": 0.3, "distance": 100.0},))
    motion, _ = _motion(rig, np.full(len(_T), 4.0))
    cut = Motion(motion.t, motion.u, motion.states, np.array([0, 1000]))
    kept = inner_states(rig, cut, np.array([0, 1000, 1500]))[:, 0]
    way = np.abs(np.diff(motion.states[1000:1501, 3])).sum()
    assert kept[:2].tolist() == [0.0, 0.0]
    assert kept[2] == pytest.approx(way, rel=1e-4)


@pytest.mark.parametrize("delay", [0.0375, 0.02, 0.0011])
@pytest.mark.parametrize("disc", [0, 1])
def test_late_readings_are_told_at_their_own_time(delay, disc):
    true = {d: (lambda x, d=d: 3.0 * x + (1 + d) * np.sin(2.0 * x)) for d in (0, 1)}
    speed = {d: 3.0 + 2.0 * (1 + d) * np.cos(2.0 * _T) for d in (0, 1)}
    alpha = {d: -4.0 * (1 + d) * np.sin(2.0 * _T) for d in (0, 1)}
    # The motion is off by far: only its speed matters, for less than half a sample.
    angles = np.zeros((len(_T), 2))
    states = np.column_stack([angles, speed[1], angles[:, 0], alpha[0], alpha[1]])
    states[:, 1] = speed[0]
    motion = Motion(_T, np.zeros(len(_T)), states, np.array([0, 1200]))
    told = on_time(true[disc](_T - delay), motion, disc, delay)
    by_speed = on_time(np.interp(_T - delay, _T, speed[disc]), motion, disc, delay, velocity=True)
    inside = np.isfinite(by_speed) & (_T > 0.1)
    assert np.abs(by_speed - speed[disc])[inside].max() < 1e-4
    known = np.isfinite(told)
    assert np.abs(told - true[disc](_T))[known].max() < 1e-6
    lost = _T[~known]
    ends = np.where(lost < _T[1200], _T[1199], _T[-1])
    assert (lost + delay > ends).all()
    assert len(lost) == 2 * int(np.ceil(delay / 0.005 - 1e-9))


def test_a_late_encoder_tells_each_reading_once():
    """At half a sample rounding chose: readings counted twice, and a delay was named for it."""
    t = np.arange(2000) * 4e-3
    motion = Motion(t, np.zeros(len(t)), np.zeros((len(t), 6)), np.array([0]))
    for delay in (0.006, 0.01, 0.01 + 1e-12, 0.0101):
        rows = telling(motion, delay)[:-5]
        assert set(np.diff(rows)) == {1}
    lost = replace(motion, t=np.where(t < 4.0, t, t + 0.1))
    rows = telling(lost, 0.01)
    assert np.abs(lost.t[rows] - lost.t - 0.01)[lost.t < 3.9].max() < 0.0021
    assert np.abs(lost.t[rows] - lost.t - 0.01)[lost.t > 4.2][:-5].max() < 0.0021
