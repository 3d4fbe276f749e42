"""Rigs with effects against other integrators, other rigs and other voltages."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import typer
from scipy.integrate import solve_ivp
from typer.testing import CliRunner

from drill_env import InputError, Rig
from drill_env.cli.simulate_command import simulate_command
from drill_env.effects import LIBRARY, Effect
from drill_env.friction import lower_curve
from drill_env.identification.replay import replay
from drill_env.identification.validation import validate
from drill_env.integrator import Disc, Kind, sampled_voltage, simulate, simulate_batch
from drill_env.parameters import dump_rig, load_rig, save_rig
from drill_env.recordings import Recording
from tests.effect_tables import library_tables
from tests.made_recordings import played

RIG = Rig()
REST = np.zeros(4)
T = np.arange(4001) * 0.005
# Forwards, at rest and backwards.
U = np.select([T < 4.0, T < 5.0, T < 9.0], [3.6, 1.2, 0.0], -3.6)


def extended(*effects: dict, rig: Rig = RIG) -> Rig:
    return rig.replace(effects=effects)


def usual(effect: Effect, amplitude: float = 1.0) -> dict:
    """The effect at so many times its usual size, in the middle of its shapes' grids."""
    entry = {"id": effect.id}
    for p in effect.parameters:
        scale = amplitude if p.role == "amplitude" else 1.0
        entry[p.name] = scale * p.grid[len(p.grid) // 2]
    return entry


# -- smooth running against SciPy ------------------------------------------------------


def lower_friction(speed):
    def step(steepness):
        return np.tanh(0.5 * steepness * speed)

    return RIG.Tsl + RIG.T1 * step(RIG.beta1) + RIG.T2 * step(RIG.beta2) + RIG.bl * speed


def scipy_run(upper, lower, more=(), more_rates=None, u=lambda t: 4.5):
    """Own equations while both discs turn forwards; `more` further states start there."""

    def rates(t, y):
        x, a, b = y[:3]
        drive = RIG.km * u(t) - RIG.Tsu - RIG.dTsu - (RIG.bu + RIG.dbu) * a
        rate_u = (drive - RIG.ktheta * x + upper(t, y)) / RIG.Ju
        rate_l = (RIG.ktheta * x - lower_friction(b) + lower(t, y)) / RIG.Jl
        extra = more_rates(t, y, rate_u, rate_l) if more_rates else []
        return [a - b, rate_u, rate_l, b, *extra]

    start = [1.0, 6.0, 6.0, 0.0, *more]
    return solve_ivp(
        rates, (0, 6), start, method="DOP853", rtol=1e-11, atol=1e-12, max_step=0.02,
        t_eval=T[:1201], dense_output=True,
    )  # fmt: skip


def nothing(t, y):
    return 0.0


def wave(t):
    return 4.5 + math.sin(3.0 * t)


def unbalance(t, y):
    return 0.03 * math.cos(y[3] + 1.0)


def damping(t, y):
    return 0.002 * (y[1] - y[2])


def half_string(z, rate):
    # Stiffness and damping of what is between a disc and a body of 4 ktheta/w^2, 2 Hz, ratio 0.02.
    return 2 * RIG.ktheta * z + 0.02 * 4 * math.pi * 4 * RIG.ktheta / (4 * math.pi) ** 2 * rate


SMOOTH = {
    "unbalance": (
        {"id": "unbalance", "torque": 0.03, "phase": 1.0},
        lambda: scipy_run(nothing, unbalance),
    ),
    "quadratic drag": (
        {"id": "quadratic_drag", "coefficient": 0.001},
        lambda: scipy_run(nothing, lambda t, y: -0.001 * abs(y[2]) * y[2]),
    ),
    "string damping": (
        {"id": "string_damping", "damping": 0.002},
        lambda: scipy_run(lambda t, y: -damping(t, y), damping),
    ),
    "string hardening": (
        {"id": "string_hardening", "coefficient": 0.001},
        lambda: scipy_run(lambda t, y: -0.001 * y[0] ** 3, lambda t, y: 0.001 * y[0] ** 3),
    ),
    "string creep": (
        {"id": "string_creep", "compliance": 0.1, "time_constant": 2.0},
        lambda: scipy_run(
            lambda t, y: 0.1 * RIG.ktheta * y[4], lambda t, y: -0.1 * RIG.ktheta * y[4],
            (1.0,), lambda t, y, a, b: [(y[0] - y[4]) / 2.0],
        ),
    ),
    "friction lag": (
        {"id": "friction_lag", "time_constant": 0.1},
        lambda: scipy_run(
            nothing, lambda t, y: lower_friction(y[2]) - lower_friction(y[4]),
            (6.0,), lambda t, y, a, b: [(y[2] - y[4]) / 0.1],
        ),
    ),
    "friction heating": (
        {"id": "friction_heating", "loss": 0.3, "time_constant": 5.0},
        lambda: scipy_run(
            nothing, lambda t, y: 0.3 * y[4] * lower_friction(y[2]),
            (0.0,), lambda t, y, a, b: [(lower_friction(y[2]) * y[2] / 0.5 - y[4]) / 5.0],
        ),
    ),
    "string inertia": (
        {"id": "string_inertia", "frequency": 2.0, "damping": 0.02},
        lambda: scipy_run(
            lambda t, y: half_string(y[4], y[5] + 0.5 * (y[2] - y[1])),
            lambda t, y: half_string(y[4], y[5] + 0.5 * (y[1] - y[2])), (0.0, 0.0),
            lambda t, y, a, b: [
                y[5], -0.5 * (a + b) - (4 * math.pi) ** 2 * y[4] - 0.04 * 4 * math.pi * y[5]
            ],
        ),
    ),
    "table": (
        {
            "id": "table", "component": "lower", "depends_on": "theta_l", "sort": "torque",
            "knots": (np.arange(200) * 2 * math.pi / 200).tolist(),
            "values": (0.03 * np.cos(np.arange(200) * 2 * math.pi / 200 + 1.0)).tolist(),
        },
        lambda: scipy_run(nothing, unbalance),
    ),
    "table of an order that is not whole": (
        {
            "id": "table", "component": "upper", "depends_on": "theta_u", "sort": "torque",
            "period": 2 * math.pi / 7.4,
            "knots": (np.arange(200) * 2 * math.pi / 7.4 / 200).tolist(),
            "values": (0.1 * np.cos(np.arange(200) * 2 * math.pi / 200 + 0.4)).tolist(),
        },
        lambda: scipy_run(lambda t, y: 0.1 * np.cos(7.4 * (y[0] + y[3]) + 0.4), nothing),
    ),
    "table of a frequency": (
        {
            "id": "table", "component": "lower", "depends_on": "time", "sort": "torque",
            "period": 1 / 0.7, "knots": (np.arange(200) / 0.7 / 200).tolist(),
            "values": (0.02 * np.cos(np.arange(200) * 2 * math.pi / 200 - 0.8)).tolist(),
        },
        lambda: scipy_run(nothing, lambda t, y: 0.02 * np.cos(2 * math.pi * 0.7 * t - 0.8)),
    ),
    "table of the drive": (
        {
            "id": "table", "component": "upper", "depends_on": "theta_u", "sort": "drive",
            "knots": (np.arange(200) * 2 * math.pi / 200).tolist(),
            "values": (0.05 * np.cos(np.arange(200) * 2 * math.pi / 200 + 0.3)).tolist(),
        },
        lambda: scipy_run(
            lambda t, y: RIG.km * 4.5 * 0.05 * np.cos(y[0] + y[3] + 0.3), nothing
        ),
    ),
    "table of friction over twist": (
        {
            "id": "table", "component": "upper", "depends_on": "twist", "sort": "friction",
            "knots": [-10.0, 0.0, 10.0], "values": [2.0, 0.0, 2.0],
        },
        lambda: scipy_run(lambda t, y: -0.2 * np.abs(y[0]), nothing),
    ),
    "table of damping over time": (
        {
            "id": "table", "component": "upper", "depends_on": "time", "sort": "damping",
            "knots": [0.0, 100.0], "values": [0.0, 2.0],
        },
        lambda: scipy_run(lambda t, y: -0.02 * t * y[1], nothing),
    ),
    "table of the string's damping": (
        {
            "id": "table", "component": "string", "depends_on": "twist", "sort": "damping",
            "knots": [-10.0, 0.0, 10.0], "values": [0.01, 0.0, 0.01],
        },
        lambda: scipy_run(
            lambda t, y: -1e-3 * np.abs(y[0]) * (y[1] - y[2]),
            lambda t, y: 1e-3 * np.abs(y[0]) * (y[1] - y[2]),
        ),
    ),
    "table of stiffness over time": (
        {
            "id": "table", "component": "string", "depends_on": "time", "sort": "stiffness",
            "knots": [0.0, 100.0], "values": [0.0, 1.0],
        },
        lambda: scipy_run(
            lambda t, y: -RIG.ktheta * 0.01 * t * y[0], lambda t, y: RIG.ktheta * 0.01 * t * y[0]
        ),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SMOOTH)
def test_smooth_running_agrees_with_scipy(name):
    effect, reference = SMOOTH[name]
    truth = reference().y[:4].T
    ours = played(extended(effect), T[:1201], np.full(1201, 4.5), truth[0])[0]
    assert truth[:, 2].min() > 1.0
    # A table is straight between its 200 knots.
    share = 1e-4 if name.startswith("table") else 1e-8
    np.testing.assert_array_less(np.abs(ours - truth).max(0), share * np.abs(truth).max(0))


def test_gear_agrees_with_two_discs_of_ones_own():
    """The upper disc split into a motor with the friction, and a disc behind a spring."""
    share, stiffness = 0.4, 8.0
    motor, disc = share * RIG.Ju, (1.0 - share) * RIG.Ju
    frequency = math.sqrt(stiffness * (1.0 / motor + 1.0 / disc)) / (2.0 * math.pi)
    # A share of 0.07 of the critical damping of the two discs against each other.
    loss = 2.0 * 0.07 * math.sqrt(stiffness * motor * (1.0 - share))

    def rates(t, y):
        x, a, b, _, wound, m = y
        torque = stiffness * wound + loss * (m - a)
        friction = RIG.Tsu + RIG.dTsu + (RIG.bu + RIG.dbu) * m
        rate_l = (RIG.ktheta * x - lower_friction(b)) / RIG.Jl
        rate_m = (RIG.km * wave(t) - friction - torque) / motor
        return [a - b, (torque - RIG.ktheta * x) / disc, rate_l, b, m - a, rate_m]

    start = [1.0, 6.0, 6.0, 0.0, 0.0, 6.0]
    found = solve_ivp(
        rates, (0, 6), start, method="DOP853", rtol=1e-10, atol=1e-12, t_eval=T[:1201]
    )
    truth = found.y[:4].T
    effect = {
        "id": "gear_compliance", "frequency": frequency, "motor_share": share,
        "friction_share": 1.0, "damping": 0.07,
    }  # fmt: skip
    ours = simulate(extended(effect), wave, 6.0, initial=truth[0]).state
    np.testing.assert_array_less(np.abs(ours - truth).max(0), 1e-3 * np.abs(truth).max(0))


def test_encoders_read_wrong_as_declared():
    truth = scipy_run(nothing, nothing)
    theta_u, theta_l = truth.y[0] + truth.y[3], truth.y[3]
    delay = 0.004
    effects = (
        {"id": "encoder_eccentricity_lower", "error": 0.02, "phase": 0.5},
        {"id": "encoder_gain_lower", "error": 0.01},
        {"id": "encoder_delay_upper", "delay": delay},
    )
    run = simulate(extended(*effects), 4.5, 6.0, initial=truth.y[:4, 0])
    wrong_l = theta_l + 0.02 * np.cos(theta_l + 0.5) + 0.01 * theta_l
    np.testing.assert_allclose(run.readings[:, 1], wrong_l, atol=1e-6)
    late = truth.sol(T[1:1201] - delay)
    np.testing.assert_allclose(run.readings[1:, 0], late[0] + late[3], atol=1e-6)
    np.testing.assert_allclose(run.theta_u, theta_u, atol=1e-6)


def test_missed_counts_lose_their_share_of_the_way():
    effect = {"id": "missed_counts_lower", "share": 0.01, "speed": 0.0}
    run = simulate(extended(effect), 3.5, 6.0)
    way = run.theta_l[-1] - run.theta_l[0]
    assert run.readings[-1, 1] - run.theta_l[-1] == pytest.approx(-0.01 * way, rel=2e-3)


def test_an_encoder_with_play_follows_a_reversal_over_its_width():
    error, width = 0.02, 0.05
    effect = {"id": "encoder_play_lower", "error": error, "width": width}
    run = simulate(extended(effect), sampled_voltage(T, U), 20.0, t_eval=T)
    way, z = np.diff(run.theta_l), np.zeros(len(T))
    for i, step in enumerate(way.tolist()):
        # Over a way in one direction what is behind comes to 1 exponentially.
        side = math.copysign(1.0, step)
        z[i + 1] = side + (z[i] - side) * math.exp(-abs(step) / width)
    np.testing.assert_allclose(run.readings[:, 1], run.theta_l - error * z, atol=2e-5)
    assert min(run.theta_l[1:] - run.theta_l[:-1]) < 0.0 < max(way) and np.ptp(z) > 1.9


# -- stick-slip against another voltage or rig -----------------------------------------


def lagged(u, time_constant):
    """Exact response of a first-order lag to a held voltage after none, as a function of time."""
    step = 0.005
    v = np.zeros_like(u)
    for i in range(len(u) - 1):
        v[i + 1] = u[i] + (v[i] - u[i]) * math.exp(-step / time_constant)

    def voltage(t):
        i = min(int(t / step + 1e-9), len(u) - 1)
        return u[i] + (v[i] - u[i]) * math.exp(-(t - i * step) / time_constant)

    return voltage


VOLTAGES = {
    "saturation": ({"id": "amplifier_saturation", "level": 2.5}, np.clip(U, -2.5, 2.5)),
    "soft saturation": (
        {"id": "soft_saturation", "level": 4.0, "softness": 0.25},
        U / (1.0 + (U / 4.0) ** 4) ** 0.25,
    ),
    "deadzone": ({"id": "amplifier_deadzone", "width": 0.5}, U - np.clip(U, -0.5, 0.5)),
    "sag": ({"id": "supply_sag", "sag": 0.05}, U * (1.0 - 0.05 * np.abs(U))),
    "gain": ({"id": "gain_asymmetry", "asymmetry": 0.1}, U + 0.1 * np.abs(U)),
    "delay": (
        {"id": "input_delay", "delay": 0.1},
        np.concatenate([np.zeros(20), U[:-20]]),
    ),
}


@pytest.mark.parametrize("name", VOLTAGES)
def test_actuator_effect_equals_another_voltage(name):
    """Through stick, slip and reversals; the truth is the exact integrator."""
    effect, played = VOLTAGES[name]
    truth = simulate(RIG, sampled_voltage(T, played), T[-1], t_eval=T)
    ours = simulate(extended(effect), sampled_voltage(T, U), T[-1], t_eval=T)
    np.testing.assert_allclose(ours.state, truth.state, atol=1e-5)
    events, true = ours.events.where(Disc.LOWER), truth.events.where(Disc.LOWER)
    np.testing.assert_array_equal(events.kind, true.kind)
    np.testing.assert_allclose(events.t, true.t, atol=1e-5)
    assert set(true.kind.tolist()) >= {Kind.SLIP, Kind.REVERSAL}


def test_actuator_lag_equals_the_lagged_voltage():
    truth = simulate(RIG, lagged(U[:1201], 0.1), 6.0, t_eval=T[:1201])
    effect = {"id": "actuator_lag", "time_constant": 0.1}
    ours = played(extended(effect), T[:1201], U[:1201], REST)[0]
    np.testing.assert_allclose(ours, truth.state, atol=1e-4)


def test_current_limit_equals_a_clipped_torque_of_the_motor():
    """By another solver, while both discs turn forward."""
    level, back_emf, volts = 1.2, 0.4, (4.0, 2.0)
    effect = {"id": "current_limit", "level": level, "back_emf": back_emf}
    begun = np.array([2.0, 4.0, 4.0, 0.0])
    n = 401

    def rates(t, y):
        twist, omega_u, omega_l, _ = y
        u = volts[int(t >= 1.0)]
        left = u - back_emf * omega_u
        drive = RIG.km * (np.clip(left, -level, level) + back_emf * omega_u)
        upper = drive - RIG.ktheta * twist - RIG.Tsu - RIG.dTsu - (RIG.bu + RIG.dbu) * omega_u
        lower = RIG.ktheta * twist - float(lower_curve(RIG, np.array([omega_l]))[0])
        return omega_u - omega_l, upper / RIG.Ju, lower / RIG.Jl, omega_l

    truth = solve_ivp(rates, (0.0, 2.0), begun, t_eval=T[:n], rtol=1e-9, atol=1e-9, max_step=0.005)
    u = np.where(T[:n] >= 1.0 - 1e-9, volts[1], volts[0])
    ours = played(extended(effect), T[:n], u, begun)[0]
    plain = played(RIG, T[:n], u, begun)[0]
    np.testing.assert_allclose(ours, truth.y.T, atol=2e-3)
    assert np.abs(ours - plain).max() > 0.5


@pytest.mark.parametrize("as_table", [False, True])
def test_stribeck_effect_on_coulomb_equals_the_stribeck_rig(as_table):
    """Break-away, sliding and sticking of an effect that is friction."""
    drop, velocity, share = 0.02, 0.5, 0.6
    true = RIG.replace(friction="stribeck", Tsl=0.04, T1=-drop, beta1=1.0 / velocity, T2=0.0)
    base = RIG.replace(friction="coulomb", Tsl=0.04 - drop, T1=0.0, T2=0.0)
    effects = [{"id": "lower_stribeck", "torque": drop, "velocity": velocity}]
    if as_table:
        # A share of it as friction that the brake has at every angle more.
        true = true.replace(Tsl=0.04, T1=0.0)
        base = base.replace(Tsl=0.04 / (1.0 + share), bl=RIG.bl / (1.0 + share))
        effects = [
            {"id": "table", "component": "lower", "depends_on": "theta_l", "sort": "friction",
             "knots": [0.0, 1.0], "values": [share, share]}
        ]  # fmt: skip
    drive = sampled_voltage(T, U)
    truth = simulate(true, drive, T[-1], t_eval=T)
    ours = simulate(extended(*effects, rig=base), drive, T[-1], t_eval=T)
    np.testing.assert_allclose(ours.state, truth.state, atol=3e-3)
    slips = [run.events.where(Disc.LOWER, Kind.SLIP) for run in (truth, ours)]
    assert len(slips[0]) == len(slips[1]) > 0
    np.testing.assert_allclose(slips[1].state[:, 0], slips[0].state[:, 0], atol=1e-4)
    stuck = [(run.modes[:, 1] == 0).mean() for run in (truth, ours)]
    assert stuck[1] == pytest.approx(stuck[0], abs=1e-3)


def test_more_friction_holds_a_disc_against_the_string_and_an_unbalance():
    """The disc breaks away where string and unbalance together exceed all its friction."""
    effects = (
        {"id": "lower_stribeck", "torque": 0.02, "velocity": 0.5},
        {"id": "unbalance", "torque": 0.01, "phase": 0.0},
    )
    run = simulate(extended(*effects), 1.0, 3.0)
    first = run.events.where(Disc.LOWER, Kind.SLIP).state[0]
    assert RIG.ktheta * first[0] + 0.01 == pytest.approx(RIG.Tsl + 0.02, rel=1e-6)
    assert first[3] == 0.0


def test_friction_step_equals_two_runs():
    heavier = RIG.replace(Tsl=1.5 * RIG.Tsl, T1=1.5 * RIG.T1, T2=1.5 * RIG.T2, bl=1.5 * RIG.bl)
    first = simulate(RIG, 3.5, 5.0)
    then = simulate(heavier, 3.5, 5.0, t_start=5.0, initial=first.final_state)
    ours = simulate(extended({"id": "friction_step", "step": 0.5, "time": 5.0}), 3.5, 10.0)
    np.testing.assert_allclose(ours.state[1000:], then.state, atol=3e-4)


def test_a_pulse_and_fading_friction_release_a_rig_at_rest():
    """At the pulse's own time, and when the friction that is left equals the motor's torque."""
    struck = extended({"id": "torque_pulse", "torque": 0.3, "time": 7.3, "duration": 5.0})
    run = simulate(struck, 0.05, 9.0, rate=100.0)
    assert run.t[run.omega_l != 0.0][0] == pytest.approx(7.31)
    fading = extended({"id": "friction_warmup", "excess": 3.0, "time_constant": 4.0})
    run = simulate(fading, 0.2, 14.0, rate=100.0)
    own = RIG.Tsu + RIG.dTsu
    freed = 4.0 * math.log(3.0 * own / (0.2 * RIG.km - own))
    assert freed < run.t[run.omega_u != 0.0][0] < freed + 0.02


def test_a_rig_at_rest_costs_one_step_a_voltage():
    """Nothing of these effects can change while nothing moves, so nothing is integrated."""
    effects = usual(LIBRARY["quadratic_drag"]), usual(LIBRARY["upper_asymmetry"])
    run = simulate(extended(*effects), 0.02, 600.0, rate=1.0)
    assert (run.state == 0.0).all() and len(run.t) == 601
    assert run.steps == 0


def test_one_inertia_runs_with_the_effects_that_fit_it():
    rig = Rig.one_inertia(km=3.5, Ju=0.5, Tsu=0.3, bu=2.0)
    run = simulate(extended({"id": "upper_quadratic_drag", "coefficient": 0.5}, rig=rig), 3.0, 10.0)
    # 0.5 w^2 + 2 w + 0.3 = 10.5
    assert run.omega_u[-1] == pytest.approx(-2.0 + math.sqrt(4.0 + 2.0 * 10.2), rel=1e-9)
    with pytest.raises(InputError, match="inertias = 1"):
        simulate(extended({"id": "string_damping", "damping": 0.1}, rig=rig), 3.0, 1.0)


# -- the whole library -------------------------------------------------------------------


@pytest.fixture(scope="module")
def plain():
    return played(RIG, T[:1801], U[:1801], REST)[1]


def readings(*effects: dict, u: np.ndarray = U) -> np.ndarray:
    return played(extended(*effects), T[:1801], u[:1801], REST)[1]


def proportional(effect: Effect) -> bool:
    return any(p.role == "amplitude" for p in effect.parameters)


@pytest.mark.parametrize("name", [n for n, e in LIBRARY.items() if proportional(e)])
def test_amplitude_0_changes_nothing(name, plain):
    np.testing.assert_allclose(readings(usual(LIBRARY[name], 0.0)), plain, atol=1e-6)


NEUTRAL = {
    "amplifier_saturation": {"level": 10.0},
    "soft_saturation": {"level": 100.0, "softness": 0.2},
    "amplifier_deadzone": {"width": 1e-4},
    "slew_limit": {"rate": 1e4},
    "actuator_lag": {"time_constant": 1e-4},
    "drive_resonance": {"frequency": 300.0, "damping": 0.7},
    "input_delay": {"delay": 0.0},
    "gear_compliance": {
        "frequency": 150.0,
        "motor_share": 0.5,
        "friction_share": 1.0,
        "damping": 0.07,
    },
    "gear_backlash": {
        "gap": 1e-4,
        "frequency": 150.0,
        "motor_share": 0.5,
        "friction_share": 1.0,
        "damping": 0.07,
    },  # fmt: skip
    "string_play": {"gap": 1e-3},
    "string_inertia": {"frequency": 100.0, "damping": 0.02},
    "friction_lag": {"time_constant": 5e-4},
    "presliding": {"distance": 2e-4},
    "lower_lugre": {"stiffness": 1000.0},
    "current_limit": {"level": 150.0, "back_emf": 0.5},
    "encoder_delay_upper": {"delay": 0.0},
    "encoder_delay_lower": {"delay": 0.0},
}


@pytest.mark.parametrize("name", [n for n, e in LIBRARY.items() if not proportional(e)])
def test_neutral_shape_changes_next_to_nothing(name, plain):
    changed = np.abs(readings({"id": name, **NEUTRAL[name]}) - plain).max()
    assert changed < 3e-3 * np.abs(plain).max()


@pytest.mark.parametrize("name", LIBRARY)
def test_usual_size_changes_the_readings(name, plain):
    entry = usual(LIBRARY[name])
    if "time" in entry:
        entry["time"] = 2.0
    if name == "dwell_stiction":
        # The disc rests for no longer than this here.
        entry["time_constant"] = 0.02
    u = U
    if name == "drive_braking_loss":
        # The usual voltage never brakes.
        u = np.where(T < 4.0, 3.6, -3.6)
        plain = readings(u=u)
    assert np.abs(readings(entry, u=u) - plain).max() > 1e-4


DISSIPATIVE = [
    {"id": "string_damping", "damping": 0.005},
    {"id": "quadratic_drag", "coefficient": 0.002},
    {"id": "whirl_drag", "torque": 0.003, "speed": 2.0, "damping": 0.3},
    {"id": "upper_quadratic_drag", "coefficient": 0.5},
    {"id": "lower_stribeck", "torque": 0.03, "velocity": 0.5},
    {"id": "upper_stribeck", "torque": 0.5, "velocity": 0.5},
    {"id": "lower_gaussian_stribeck", "torque": 0.03, "velocity": 1.0},
    {"id": "upper_gaussian_stribeck", "torque": 0.5, "velocity": 1.0},
    {"id": "load_dependent_friction", "coefficient": 0.5},
    {"id": "friction_warmup", "excess": 0.5, "time_constant": 5.0},
    {"id": "friction_drift", "drift": 2.0},
    {"id": "brake_runout", "runout": 0.5, "phase": 0.0, "order": 3.0},
]


@pytest.mark.parametrize("effect", DISSIPATIVE, ids=lambda e: e["id"])
def test_dissipative_effect_never_adds_energy(effect):
    """Nothing drives the rig, so its energy can only fall."""
    start = np.array([8.0, 3.0, -4.0, 0.0])
    y = played(extended(effect), T[:1201], np.zeros(1201), start)[0]
    energy = 0.5 * (RIG.Ju * y[:, 1] ** 2 + RIG.Jl * y[:, 2] ** 2 + RIG.ktheta * y[:, 0] ** 2)
    assert np.diff(energy).max() < 1e-6 * energy[0]


# -- declarations --------------------------------------------------------------------------


def test_round_trip_through_a_rig_file(tmp_path: Path):
    table = {
        "id": "table", "component": "sensor", "depends_on": "time", "sort": "error",
        "encoder": "upper", "knots": [0.0, 1.0, 5.0], "values": [0.0, 0.01, -0.01],
    }  # fmt: skip
    rig = extended(usual(LIBRARY["unbalance"]), usual(LIBRARY["friction_step"]), table)
    save_rig(rig, tmp_path / "rig.toml")
    again = load_rig(tmp_path / "rig.toml")
    assert again == rig
    assert dump_rig(again) == dump_rig(rig)
    runs = [simulate(r, 3.5, 4.0) for r in (rig, again)]
    np.testing.assert_array_equal(runs[0].readings, runs[1].readings)
    error = runs[0].readings[:, 0] - runs[0].theta_u
    np.testing.assert_allclose(error, np.interp(runs[0].t, [0, 1, 5], [0, 0.01, -0.01]), atol=1e-12)


TABLE = {"id": "table", "component": "lower", "depends_on": "time", "sort": "torque",
         "knots": [0.0, 1.0], "values": [0.0, 0.1]}  # fmt: skip
BAD = {
    "no id": ({}, ["effect 1", "id is None", "unbalance", "table"]),
    "unknown id": ({"id": "unbalanc"}, ["'unbalanc'", "unbalance"]),
    "list as id": ({"id": ["x"]}, ["['x']"]),
    "missing": ({"id": "unbalance", "torque": 0.1}, ["missing parameter phase"]),
    "unknown": ({"id": "supply_sag", "sag": 0.1, "x": 1}, ["unknown parameter x", "sag"]),
    "text": ({"id": "supply_sag", "sag": "big"}, ["sag is 'big'", "number"]),
    "flag": ({"id": "supply_sag", "sag": True}, ["sag is True", "number"]),
    "range": ({"id": "unbalance", "torque": -1.0, "phase": 0.0}, ["torque is -1", "0 to"]),
    "nan": ({"id": "supply_sag", "sag": math.nan}, ["sag is nan"]),
    "coordinate": ({**TABLE, "depends_on": "x"}, ["depends_on is 'x'", "twist"]),
    "sort": ({**TABLE, "sort": "torqe"}, ["'torqe'", "friction"]),
    "component": ({**TABLE, "component": "string", "sort": "friction"}, ["friction with upper"]),
    "period": ({**TABLE, "period": 0.0}, ["period is 0.0", "greater than 0"]),
    "periods": ({**TABLE, "period": 0.5}, ["outside 0 to 0.5"]),
    "knots": ({**TABLE, "knots": [1.0, 0.0]}, ["ascending"]),
    "lengths": ({**TABLE, "values": [1.0]}, ["2 knots and 1 values"]),
    "no list": ({**TABLE, "values": "abc"}, ["values is 'abc'", "list"]),
    "no number": ({**TABLE, "values": [0.0, math.inf]}, ["finite"]),
    "turns": ({**TABLE, "depends_on": "theta_l", "knots": [0.0, 9.0]}, ["2 pi"]),
    "encoder": ({**TABLE, "sort": "error"}, ["encoder is None", "upper"]),
    "extra key": ({**TABLE, "knot": 1}, ["unknown key knot"]),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_entry_gives_one_clear_error(name):
    entry, texts = BAD[name]
    with pytest.raises(InputError) as caught:
        simulate(extended(entry), 3.5, 1.0)
    assert "\n" not in str(caught.value)
    for text in texts:
        assert text in str(caught.value)


def test_sensitivities_by_a_delay_are_refused():
    rig = extended(usual(LIBRARY["input_delay"]))
    with pytest.raises(InputError, match="sensitivity is not offered with input_delay"):
        simulate(rig, 3.5, 1.0, sensitivity=True)


# -- what runs such rigs -------------------------------------------------------------------


def test_batch_and_replay_run_with_effects():
    effects = usual(LIBRARY["actuator_lag"]), usual(LIBRARY["encoder_eccentricity_lower"], 10.0)
    rig = extended(*effects)
    drive = sampled_voltage(T[:1201], U[:1201])
    runs = simulate_batch([rig, RIG], drive, 6.0, t_eval=T[:1201])
    np.testing.assert_array_equal(runs[0].state, simulate(rig, drive, 6.0, t_eval=T[:1201]).state)
    np.testing.assert_array_equal(runs[1].state, simulate(RIG, drive, 6.0, t_eval=T[:1201]).state)
    theta_u, theta_l = runs[0].readings.T
    recording = Recording(t=T[:1201] + 7.0, u=U[:1201], theta_u=theta_u, theta_l=theta_l)
    own, other = (replay(recording, r, initial=REST).errors["theta_l"].max for r in (rig, RIG))
    assert own < 1e-9
    assert other > 0.03
    with pytest.raises(InputError, match=r"\[\[effects\]\].*replay"):
        validate(recording, rig)


def test_command_line_simulates_a_rig_file_with_effects(tmp_path: Path):
    rig = extended(usual(LIBRARY["unbalance"], 10.0), usual(LIBRARY["encoder_gain_lower"], 10.0))
    save_rig(rig, tmp_path / "rig.toml")
    args = ["--rig", tmp_path / "rig.toml", "--volts", "3.5", "--seconds", "4", "--out"]
    app = typer.Typer()
    app.command()(simulate_command)
    done = CliRunner().invoke(app, [str(a) for a in (*args, tmp_path / "run.csv")])
    assert done.exit_code == 0, done.output
    table = pd.read_csv(tmp_path / "run.csv")
    truth = simulate(rig, 3.5, 4.0)
    np.testing.assert_allclose(table["theta_l"], truth.readings[:, 1], atol=1e-9)
    np.testing.assert_allclose(table["omega_l"], truth.omega_l, atol=1e-9)


def test_documentation_lists_the_library():
    page = Path(__file__).parents[1] / "docs" / "effects.md"
    assert library_tables() in page.read_text(encoding="utf-8")
