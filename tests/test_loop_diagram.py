"""The controlled rig's diagram against linear theory, the open-loop diagram and simulation."""

from __future__ import annotations

import dataclasses
import functools

import control
import numpy as np
import pytest
from scipy.signal import butter

from drill_env import InputError, Rig, baselines
from drill_env.continuation import CycleError, Point, StepRule
from drill_env.continuation.loop_clock import OwnClock
from drill_env.continuation.loop_diagram import LoopDiagram, loop_diagram
from drill_env.continuation.loop_equilibria import equilibrium_at, motion_of
from drill_env.continuation.loop_law import HiddenMemoryError
from drill_env.continuation.loop_period import SampledLoop
from drill_env.continuation.loop_tables import both_tables, loop_point_documents, loop_table
from drill_env.environment.config import EnvConfig
from drill_env.environment.vector_env import DrillStringVectorEnv
from drill_env.friction import lower_curve
from drill_env.integrator import Disc, Kind

RIG = Rig()
CONFIG = EnvConfig(voltage_limit=15.0)
COARSE = StepRule(largest=0.4, turn=0.5)
PERIOD = CONFIG.control_period


class Lead:
    """Proportional to the error now and two periods ago: it needs past frames."""

    view, history = "both", 2

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

    view, history = "both", 2

    def act(self, observation: np.ndarray) -> np.ndarray:
        return super().act(observation.astype(np.float32)).astype(np.float32)


class Secretive:
    """An integrator that tells nobody what it has summed up."""

    view, history = "surface", 0

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
    step, b_a = 1.0 / CONFIG.encoder.rate_hz, butter(2, 5.0, fs=100.0)
    # With the angle of the upper disc as a fourth state.
    wide = np.block([[matrix, np.zeros((3, 1))], [np.array([[0.0, 1.0, 0.0, 0.0]])]])
    plant = control.ss(wide, np.vstack([drive, [[0.0]]]), [[0.0, 0.0, 0.0, 1.0]], 0.0)
    difference = control.tf([1.0 / step, -1.0 / step], [1.0, 0.0], step)
    chain = control.tf2ss(control.tf(*b_a, step)) * control.tf2ss(difference)
    fast = chain * control.c2d(plant, step, "zoh")
    count = CONFIG.samples
    powers = [np.linalg.matrix_power(fast.A, k) for k in range(count + 1)]
    # The measured speed is the filter's output at the last sample, so it leads by one step.
    first = fast.C @ np.linalg.pinv(fast.A) if False else fast.C
    return control.ss(powers[count], sum(powers[:count]) @ fast.B, first, fast.D, PERIOD)


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


def environment_run(controller, setpoint: float, start: np.ndarray, steps: int) -> np.ndarray:
    """omega_l (rad/s) at the ends of the control periods, in the environment itself."""
    exact = dataclasses.replace(CONFIG.encoder, counts_per_rev=0)
    config = dataclasses.replace(
        CONFIG, encoder=exact, observation=controller.view, history=controller.history, rtol=1e-10
    )
    fields = {item.name: getattr(config, item.name) for item in dataclasses.fields(config)}
    env = DrillStringVectorEnv(1, **fields)
    options = {"setpoint": setpoint, "start": "state", "state": start}
    observation, _ = env.reset_each(0, [options])
    controller.reset(1)
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


@functools.cache
def constant_voltage(low: float, high: float) -> LoopDiagram:
    return loop_diagram(baselines.OpenLoop(CONFIG), CONFIG, low, high, rule=COARSE)


def test_without_feedback_it_is_the_open_loop_diagram():
    """A constant voltage does not see the clock: the issue's points to all their digits."""
    truth = [
        ("neimark-sacker", 0.565729), ("grazing", 1.8136730), ("reversal", 1.8807277),
        ("last stick", 2.1081950),
    ]  # fmt: skip
    points = loop_point_documents(constant_voltage(0.5, 4.0).points)
    assert [p["kind"] for p in points] == [kind for kind, _ in truth]
    assert [p["volts"] for p in points] == pytest.approx([v for _, v in truth], abs=4e-7)
    assert points[0]["setpoint"] == pytest.approx(0.815194, abs=5e-7)
    assert points[0]["frequency_rad_s"] == pytest.approx(1.55297, abs=5e-6)
    assert "supercritical" in points[0]["remark"]


def test_the_fold_and_the_unstable_cycles_of_the_open_loop():
    found = constant_voltage(23.5, 26.0)
    points = {p["kind"]: p for p in loop_point_documents(found.points)}
    assert points["neimark-sacker"]["volts"] == pytest.approx(13.183694, abs=5e-7)
    assert "subcritical" in points["neimark-sacker"]["remark"]
    fold = points["fold"]
    assert fold["volts"] == pytest.approx(14.1692825, abs=1e-6)
    assert (fold["min"], fold["max"]) == pytest.approx((0.73895, 50.35439), abs=5e-6)
    assert fold["period_s"] == pytest.approx(4.0483632, abs=5e-8)
    assert fold["multipliers"][0][0] == pytest.approx(1.0, abs=1e-4)
    assert found.failures == ()


def test_the_stability_limit_of_pi_against_simulation():
    """Just below it a small swing decays, just above it grows, at the computed rates."""
    pi = baselines.SpeedPI
    found = loop_diagram(pi(CONFIG), CONFIG, 0.6, 1.0, rule=COARSE)
    (limit,) = [p for p in found.points if p.kind == "neimark-sacker"]
    assert limit.parameter == pytest.approx(0.79313, abs=5e-6) and limit.error < 1e-8
    for side in (-0.05, 0.05):
        setpoint = limit.parameter + side
        _, point = equilibrium_at(found.loop, setpoint)
        start = np.append(point.z[:3], 0.0)
        start[2] += 1e-3
        speeds = environment_run(pi(CONFIG), setpoint, start, 1640)[820:]
        # Two natural periods of the swing of 82 control periods each.
        swings = np.ptp(speeds.reshape(-1, 82), axis=1)
        rate = np.polyfit(np.arange(len(swings)) * 82 * PERIOD, np.log(swings), 1)[0]
        assert np.sign(rate) == np.sign(side)
        assert rate == pytest.approx(motion_of(point).growth_rate, rel=0.1)


@functools.cache
def soft_pi() -> LoopDiagram:
    """A soft PI, whose upper stability limit is subcritical below the voltage limit."""
    return loop_diagram(
        baselines.SpeedPI(CONFIG, pole=1.0), CONFIG, 23.0, 25.2, rule=COARSE
    )  # fmt: skip


def near_cycle(found: LoopDiagram, setpoint: float, stable: bool) -> tuple[OwnClock, Point]:
    """The cycle at one set point, and the interpolation to the loop's clock."""
    points = [p for b in found.branches for p in b.points if p.cycle.stable == stable]
    near = min(points, key=lambda p: abs(p.z[-1] - setpoint))
    clock = OwnClock(found.loop, 1.0 + np.abs(near.z))
    beats = motion_of(near).beats
    return clock, clock.corrector(beats).at_parameter(near.z, setpoint)


def test_unstable_cycles_of_soft_pi_separate_the_basins():
    """Bisection between equilibrium and stable cycle meets the unstable cycle."""
    found, setpoint = soft_pi(), 24.2
    _, rest = equilibrium_at(found.loop, setpoint)
    clock, cycle = near_cycle(found, setpoint, stable=False)
    assert rest.cycle.stable and abs(cycle.cycle.multipliers[0]) > 1.01

    def fate(share: float) -> bool:
        """Whether the loop ends on the large cycle."""
        state, modes = rest.z[:-2] + share * (cycle.z[:-2] - rest.z[:-2]), None
        high = 0.0
        for k in range(3000):
            step = found.loop.advance(state, PERIOD, setpoint, modes, sensitivity=False)
            state, modes = step.state, step.run.final_modes
            high = max(high, abs(state[2] - setpoint)) if k % 82 else 0.0
            swing = cycle.cycle.max - setpoint
            if k % 82 == 81 and not 0.7 < high / swing < 1.2:
                break
        return high > swing

    low, up = 0.8, 1.2
    assert not fate(low) and fate(up)
    for _ in range(8):
        middle = 0.5 * (low + up)
        low, up = (low, middle) if fate(middle) else (middle, up)
    assert 0.5 * (low + up) == pytest.approx(1.0, abs=5e-3)


@pytest.mark.parametrize("setpoint", [1.5, 4.0, 8.0])
def test_stable_cycles_of_pi_against_the_attractor(setpoint):
    """The loop settles on a torus around the cycle of its own clock."""
    found = loop_diagram(baselines.SpeedPI(CONFIG), CONFIG, 0.6, 8.5, rule=COARSE) if False else pi()
    clock, point = near_cycle(found, setpoint, stable=True)
    cycle = motion_of(clock.own(point))
    state, modes, times, peaks, lows = point.z[:-2], None, [], [], []
    for k in range(82 * 60):
        step = found.loop.advance(state, PERIOD, setpoint, modes, sensitivity=False)
        state, modes = step.state, step.run.final_modes
        if k > 82 * 15:
            turns = step.run.events.where(Disc.LOWER, Kind.MAXIMUM)
            high = turns.state[:, 2] > 0.8 * cycle.max
            times += (k * PERIOD + turns.t[high]).tolist()
            peaks += turns.state[high, 2].tolist()
            lows += step.run.events.where(Disc.LOWER, Kind.MINIMUM).state[:, 2].tolist()
    period = (times[-1] - times[0]) / (len(times) - 1)
    print(setpoint, np.mean(peaks)-cycle.max, np.ptp(peaks), min(lows)-cycle.min, period-cycle.period)
    assert period == pytest.approx(cycle.period, abs=2e-4)
    assert np.mean(peaks) == pytest.approx(cycle.max, rel=1e-4)
    assert min(lows) == pytest.approx(cycle.min, abs=2e-3)


@functools.cache
def pi() -> LoopDiagram:
    return loop_diagram(baselines.SpeedPI(CONFIG), CONFIG, 0.6, 8.5, rule=COARSE)
