"""The controlled rig's diagram against linear theory, the open-loop diagram and simulation."""

from __future__ import annotations

import dataclasses
import functools

import control
import numpy as np
import pytest
from scipy.signal import butter

from drill_env import InputError, Rig, baselines
from drill_env.continuation import CycleError, Point, StepRule, bifurcation_diagram
from drill_env.continuation.loop_clock import OwnClock
from drill_env.continuation.loop_diagram import LoopDiagram, loop_diagram
from drill_env.continuation.loop_equilibria import equilibrium_at, motion_of
from drill_env.continuation.loop_law import HiddenMemoryError
from drill_env.continuation.loop_period import SampledLoop
from drill_env.continuation.loop_tables import both_tables, loop_point_documents, loop_table
from drill_env.environment.config import EnvConfig, View
from drill_env.environment.vector_env import DrillStringVectorEnv
from drill_env.friction import lower_curve
from drill_env.integrator import Disc, Kind

RIG = Rig()
CONFIG = EnvConfig(voltage_limit=15.0)
COARSE = StepRule(largest=0.4, turn=0.5)
PERIOD = CONFIG.control_period


class Lead:
    """Proportional to the error now and two periods ago: it needs past frames."""

    view: View = "both"
    history: int = 2

    def __init__(self, config: EnvConfig) -> None:
        self._rig = config.rig

    def reset(self, n: int) -> None:
        pass

    def act(self, observation: np.ndarray) -> np.ndarray:
        now, old = observation[:, 1], observation[:, 10]
        error = observation[:, 3] - now
        return 0.12 + 0.55 * observation[:, 3] + 0.4 * error - 0.1 * (now - old)


class SinglePrecision(Lead):
    """The same in single precision, as a neural network computes."""

    def act(self, observation: np.ndarray) -> np.ndarray:
        return super().act(observation.astype(np.float32)).astype(np.float32)


class Secretive:
    """An integrator that tells nobody what it has summed up."""

    view: View = "surface"
    history: int = 0

    def __init__(self) -> None:
        self._sum = np.zeros(1)

    def reset(self, n: int) -> None:
        self._sum = np.zeros(n)

    def act(self, observation: np.ndarray) -> np.ndarray:
        self._sum = self._sum + observation[:, 1] - observation[:, 0]
        return 0.1 * self._sum


def rig_matrix(omega: float) -> tuple[np.ndarray, np.ndarray]:
    """The rig's linearisation, its friction slope by differences; the voltage's column."""
    slope = float(lower_curve(RIG, omega + 1e-5) - lower_curve(RIG, omega - 1e-5)) / 2e-5
    matrix = [
        [0.0, 1.0, -1.0],
        [-RIG.ktheta / RIG.Ju, -(RIG.bu + RIG.dbu) / RIG.Ju, 0.0],
        [RIG.ktheta / RIG.Jl, 0.0, -slope / RIG.Jl],
    ]
    return np.array(matrix), np.array([[0.0], [RIG.km / RIG.Ju], [0.0]])


def speed_signal(omega: float, filtered: bool) -> control.StateSpace:
    """From the held voltage to the measured omega_u, sampled once a control period."""
    matrix, drive = rig_matrix(omega)
    if not filtered:
        plant = control.ss(matrix, drive, [[0.0, 1.0, 0.0]], 0.0)
        return control.c2d(plant, PERIOD, "zoh")
    step, low_pass = 1.0 / CONFIG.encoder.rate_hz, butter(2, 5.0, fs=100.0)
    # With the angle of the upper disc as a fourth state.
    wide = np.block([[matrix, np.zeros((3, 1))], [np.array([[0.0, 1.0, 0.0, 0.0]])]])
    plant = control.ss(wide, np.vstack([drive, [[0.0]]]), [[0.0, 0.0, 0.0, 1.0]], 0.0)
    difference = control.tf([1.0 / step, -1.0 / step], [1.0, 0.0], step)
    chain = control.tf2ss(control.tf(*low_pass, step)) * control.tf2ss(difference)
    fast = chain * control.c2d(plant, step, "zoh")
    count = CONFIG.samples
    powers = [np.linalg.matrix_power(fast.A, k) for k in range(count + 1)]
    held = np.sum([power @ fast.B for power in powers[:count]], axis=0)
    return control.ss(powers[count], held, fast.C, fast.D, PERIOD)


@pytest.mark.parametrize("filtered", [False, True])
@pytest.mark.parametrize("omega", [0.5, 4.0, 20.0])
def test_eigenvalues_against_python_control(omega, filtered):
    """Independent: zero-order hold of the linear rig, closed by the PI as a transfer function."""
    pi = baselines.SpeedPI(CONFIG)
    _, point = equilibrium_at(SampledLoop(pi, CONFIG, filtered), omega)
    law = control.tf([pi.kp + pi.ki * PERIOD, -pi.kp], [1.0, -1.0], PERIOD)
    closed = control.feedback(speed_signal(omega, filtered) * control.tf2ss(law), 1)
    poles = np.linalg.eigvals(closed.A)
    ours = point.cycle.multipliers[np.abs(point.cycle.multipliers) > 1e-2]
    assert len(ours) >= 4
    for value in ours:
        assert np.abs(poles - value).min() < 1e-6
    assert point.z[2] == pytest.approx(omega, abs=1e-9)


def environment_run(
    controller, setpoint: float, start: np.ndarray, steps: int, memory: np.ndarray | None = None
) -> np.ndarray:
    """omega_l (rad/s) at the ends of the control periods, in the environment itself."""
    exact = dataclasses.replace(CONFIG.encoder, counts_per_rev=0)
    config = dataclasses.replace(
        CONFIG, encoder=exact, observation=controller.view, history=controller.history,
        episode_seconds=1e3, rtol=1e-10,
    )  # fmt: skip
    fields = {item.name: getattr(config, item.name) for item in dataclasses.fields(config)}
    env = DrillStringVectorEnv(1, **fields)
    options = {"setpoint": setpoint, "start": "state", "state": start}
    observation, _ = env.reset_each(0, [options])
    controller.reset(1)
    if memory is not None:
        controller.recall(memory[None])
    speeds = np.zeros(steps)
    for k in range(steps):
        volts = controller.act(observation.astype(np.float64))
        observation, _, _, _, info = env.step(volts[:, None])
        speeds[k] = info["omega_l"][0]
    return speeds


@pytest.mark.parametrize("maker", [baselines.SpeedPI, baselines.ActiveDamping, Lead])
def test_the_loop_is_the_environments(maker):
    """From a push that makes the disc stick and reverse; observations there are singles."""
    start = np.array([1.0, 3.0, 2.5, 0.0])
    truth = environment_run(maker(CONFIG), 3.0, start, 160)
    loop = SampledLoop(maker(CONFIG), CONFIG)
    state, modes, speeds = loop.settled_state(start, 3.0, 0.0), None, []
    if maker is not Lead:
        # Before its first call the integral is empty; the high-pass then sees the torque.
        state[-1] = 0.0 if maker is baselines.SpeedPI else RIG.ktheta * start[0]
        state[-2] = 0.0 if maker is baselines.ActiveDamping else state[-2]
    for _ in range(len(truth)):
        step = loop.advance(state, PERIOD, 3.0, modes, sensitivity=False)
        state, modes = step.state, step.run.final_modes
        speeds.append(state[2])
    assert np.abs(np.array(speeds) - truth).max() < 1e-5


@pytest.mark.parametrize("maker", [baselines.SpeedPI, baselines.ActiveDamping, Lead])
def test_derivatives_of_a_control_period_against_differences(maker):
    loop = SampledLoop(maker(CONFIG), CONFIG)
    state = loop.steady(3.0)
    z = np.append(state + 0.02 * np.cos(np.arange(len(state))), [PERIOD, 3.1])
    jacobian = loop.advance(z[:-2], z[-2], z[-1]).jacobian
    for k in range(len(z)):
        ends = []
        for sign in (1.0, -1.0):
            moved = z.copy()
            moved[k] += sign * 1e-6
            ends.append(loop.advance(moved[:-2], moved[-2], moved[-1], sensitivity=False).state)
        assert jacobian[:, k] == pytest.approx((ends[0] - ends[1]) / 2e-6, abs=2e-7)


def test_without_feedback_it_is_the_open_loop_diagram():
    """A constant voltage does not see the clock: the issue's points to all their digits."""
    truth = [
        ("neimark-sacker", 0.565729), ("grazing", 1.8136730), ("reversal", 1.8807277),
        ("last stick", 2.1081950),
    ]  # fmt: skip
    found = loop_diagram(baselines.OpenLoop(CONFIG), CONFIG, 0.5, 4.0, starts=1, rule=COARSE)
    points = loop_point_documents(found.points)
    assert [p["kind"] for p in points] == [kind for kind, _ in truth]
    assert [p["volts"] for p in points] == pytest.approx([v for _, v in truth], abs=4e-7)
    assert points[0]["setpoint"] == pytest.approx(0.815194, abs=5e-7)
    assert points[0]["frequency_rad_s"] == pytest.approx(1.55297, abs=5e-6)
    assert "supercritical" in points[0]["remark"]
    assert len(found.branches) == 1 and found.failures == ()


def test_the_fold_of_the_open_loop_from_a_settled_motion():
    """No cycle is born in this range: the branch is met by simulation and passes the fold."""
    law = baselines.OpenLoop(CONFIG)
    found = loop_diagram(law, CONFIG, 24.8, 25.8, starts=1, rule=COARSE)
    (fold,) = loop_point_documents(found.points)
    assert fold["kind"] == "fold" and fold["volts"] == pytest.approx(14.1692825, abs=1e-6)
    assert (fold["min"], fold["max"]) == pytest.approx((0.73895, 50.35439), abs=5e-6)
    assert fold["period_s"] == pytest.approx(4.0483632, abs=5e-8)
    assert fold["multipliers"][0][0] == pytest.approx(1.0, abs=1e-4)
    assert found.failures == ()
    cycles = [p.cycle for b in found.branches for p in b.points]
    # Along the flow nothing grows: where it is 1 the clock has locked no cycle.
    assert max(abs(c.trivial - 1.0) for c in cycles) < 1e-7
    unstable = [c for c in cycles if not c.stable]
    assert unstable and all(abs(c.multipliers[0]) > 1.0 for c in unstable)


@functools.cache
def stiff_pi() -> LoopDiagram:
    return loop_diagram(baselines.SpeedPI(CONFIG), CONFIG, 0.6, 4.2, starts=0, rule=COARSE)


def test_the_stability_limit_of_pi_against_simulation():
    """Just below it a small swing decays, just above it grows, at the computed rates."""
    found = stiff_pi()
    limit = found.points[0]
    assert limit.kind == "neimark-sacker" and limit.error < 1e-8
    for side in (-0.05, 0.05):
        setpoint = limit.parameter + side
        _, rest = equilibrium_at(found.loop, setpoint)
        start = np.append(rest.z[:3], 0.0)
        start[2] += 1e-3
        memory = rest.z[-3:-2]
        swing = environment_run(baselines.SpeedPI(CONFIG), setpoint, start, 1640, memory) - setpoint
        turns = np.diff(swing)
        peaks = 1 + np.flatnonzero(turns[:-1] * turns[1:] < 0.0)[8:]
        rate = np.polyfit(peaks * PERIOD, np.log(np.abs(swing[peaks])), 1)[0]
        assert np.sign(rate) == np.sign(side)
        assert rate == pytest.approx(motion_of(rest).growth_rate, rel=0.01)


def near_cycle(found: LoopDiagram, setpoint: float, stable: bool) -> tuple[OwnClock, Point]:
    """The cycle at one set point, and the interpolation to the loop's clock."""
    points = [p for b in found.branches for p in b.points if p.cycle.stable == stable]
    near = min(points, key=lambda p: abs(p.z[-1] - setpoint))
    clock = OwnClock(found.loop, 1.0 + np.abs(near.z))
    return clock, clock.corrector(motion_of(near).beats).at_parameter(near.z, setpoint)


def test_unstable_cycles_of_a_soft_pi_separate_the_basins():
    """Simulations from shares of the way out to the unstable cycle fall back or grow."""
    law, setpoint = baselines.SpeedPI(CONFIG, pole=1.0), 24.5
    found = loop_diagram(law, CONFIG, 23.3, 24.6, starts=0, rule=COARSE)
    assert "subcritical" in found.points[0].remark
    _, rest = equilibrium_at(found.loop, setpoint)
    _, cycle = near_cycle(found, setpoint, stable=False)
    assert rest.cycle.stable and abs(cycle.cycle.multipliers[0]) > 1.02
    swing = cycle.cycle.max - setpoint

    def grows(share: float) -> bool:
        state, modes = rest.z[:-2] + share * (cycle.z[:-2] - rest.z[:-2]), None
        peak = 0.0
        for _ in range(60):
            peak = 0.0
            for _ in range(82):
                step = found.loop.advance(state, PERIOD, setpoint, modes, sensitivity=False)
                state, modes = step.state, step.run.final_modes
                peak = max(peak, (state[2] - setpoint) / swing)
            if not 0.7 < peak < 1.3:
                break
        return peak > 1.0

    low, high = 0.8, 1.2
    assert not grows(low) and grows(high)
    for _ in range(6):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if grows(middle) else (middle, high)
    assert 0.5 * (low + high) == pytest.approx(1.0, abs=8e-3)


@pytest.mark.parametrize("setpoint", [1.5, 4.0])
def test_stable_cycles_of_pi_against_the_attractor(setpoint):
    """With the clock it has, which no period fits, the loop settles on the same cycle."""
    found = stiff_pi()
    clock, point = near_cycle(found, setpoint, stable=True)
    cycle = motion_of(clock.own(point))
    # The cycle of the stretched clock is known to be elsewhere.
    assert abs(cycle.max - point.cycle.max) > 1e-4
    state, modes, times, peaks, lows = point.z[:-2], None, [], [], []
    for k in range(82 * 30):
        step = found.loop.advance(state, PERIOD, setpoint, modes, sensitivity=False)
        state, modes = step.state, step.run.final_modes
        turns = step.run.events.where(Disc.LOWER)
        if k > 82 * 10:
            high = (turns.kind == Kind.MAXIMUM) & (turns.state[:, 2] > 0.8 * cycle.max)
            times += (k * PERIOD + turns.t[high]).tolist()
            peaks += turns.state[high, 2].tolist()
            lows += turns.state[turns.kind == Kind.MINIMUM, 2].tolist()
    period = (times[-1] - times[0]) / (len(times) - 1)
    assert period == pytest.approx(cycle.period, abs=3e-6)
    assert np.array(peaks) == pytest.approx(cycle.max, abs=5e-5)
    assert min(lows) == pytest.approx(cycle.min, abs=5e-5)


def test_special_points_of_the_loop_do_not_depend_on_the_number_of_beats():
    """Steps of another length locate them on other clocks; the errors cover the difference."""
    other = loop_diagram(
        baselines.SpeedPI(CONFIG), CONFIG, 2.4, 3.5, starts=1, rule=StepRule(largest=0.15)
    )
    ours = [p for p in stiff_pi().points if p.parameter > 2.5]
    assert [p.kind for p in ours] == [p.kind for p in other.points]
    for a, b in zip(ours, other.points, strict=True):
        assert abs(a.parameter - b.parameter) <= a.error + b.error


def test_a_controller_with_past_frames_and_one_in_single_precision():
    double = loop_diagram(Lead(CONFIG), CONFIG, 0.5, 2.0, starts=0, rule=COARSE)
    (limit, *_) = [p for p in double.points if p.kind == "neimark-sacker"]
    single = loop_diagram(SinglePrecision(CONFIG), CONFIG, 0.5, 2.0, starts=0, rule=COARSE)
    (same, *_) = [p for p in single.points if p.kind == "neimark-sacker"]
    assert single.loop.law.rounded and not double.loop.law.rounded
    assert same.parameter == pytest.approx(limit.parameter, abs=1e-3)
    # A proportional law leaves an error that an integral would remove.
    motions = [motion_of(p) for p in double.equilibria.points]
    assert any(abs(m.max - m.parameter) > 1e-3 for m in motions)


def test_tables_lay_both_diagrams_side_by_side():
    found = stiff_pi()
    table = loop_table(found, "pi")
    assert table.branch.drop_duplicates().tolist() == ["e1", "e2", "p1"]
    assert table.groupby("branch").stable.first().tolist() == [True, False, True]
    assert table.setpoint.min() == 0.6 and table.setpoint.max() == pytest.approx(4.2, abs=1e-9)
    assert ((table.growth_rate < 0.0) == table.stable).all()
    both = both_tables(found, "pi", bifurcation_diagram(RIG, 5.0))
    free = both[both.controller == "none"]
    assert set(table.columns) == set(both.columns) and len(free) > 100
    assert ((free.growth_rate < 0.0) == free.stable).all()
    # Below the Hopf point at 0.815 rad/s the free rig is stable, above it is not.
    rest = free[free.kind == "equilibrium"]
    assert (rest.stable == (rest.setpoint < 0.815194)).all()


def test_what_cannot_be_continued_is_refused():
    with pytest.raises(HiddenMemoryError, match="recall"):
        loop_diagram(Secretive(), CONFIG, 0.5, 1.0)
    with pytest.raises(InputError, match="smaller one first"):
        loop_diagram(baselines.SpeedPI(CONFIG), CONFIG, 2.0, 1.0)
    late = dataclasses.replace(CONFIG, encoder=dataclasses.replace(CONFIG.encoder, delay_s=0.1))
    with pytest.raises(InputError, match="delay_s"):
        loop_diagram(baselines.SpeedPI(late), late, 0.5, 1.0)
    # No voltage below the limit holds this speed.
    weak = EnvConfig(voltage_limit=2.0)
    with pytest.raises(CycleError):
        equilibrium_at(SampledLoop(baselines.SpeedPI(weak), weak), 20.0)
