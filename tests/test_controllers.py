"""Classical controllers against linear theory, exact simulation and each other."""

from __future__ import annotations

import dataclasses

import control as ct
import numpy as np
import pytest
from scipy.optimize import lsq_linear

from drill_env import InputError, Rig, baselines
from drill_env.baselines import _adaptive as regulator
from drill_env.baselines import _filter as kernels
from drill_env.baselines.kalman import filter_gain, torque_noise
from drill_env.baselines.linear import noise_levels, sampled_rig, surface_part
from drill_env.benchmark.linear_facts import (
    closed_poles,
    design_facts,
    realise,
    surface_bound,
)
from drill_env.benchmark.plants import frozen_plants
from drill_env.benchmark.rollout import run_plants
from drill_env.dynamics import equilibrium_state, equilibrium_voltage
from drill_env.environment import DrillStringEnv
from drill_env.environment.config import EnvConfig
from drill_env.friction import kernel_record
from drill_env.sensors import Encoder

CONFIG = EnvConfig()
OMEGA = np.geomspace(0.05, 50.0, 60)


def response(system, omega=OMEGA):
    """Frequency response of a sampled system, shape (outputs, inputs, n)."""
    return np.array([system(np.exp(1j * w * system.dt), squeeze=False) for w in omega])


def test_sampled_rig_predicts_the_exact_environment():
    setpoint, pushes = 2.0, 1e-3 * np.random.default_rng(1).standard_normal(60)
    env = DrillStringEnv(
        encoder=Encoder(counts_per_rev=0), setpoint=setpoint, start="equilibrium", rtol=1e-10
    )
    rest, _ = env.reset(seed=0)
    volts = float(equilibrium_voltage(Rig(), setpoint))
    plant = sampled_rig(env.unwrapped.config, setpoint)
    state, worst = np.zeros(len(plant.A)), 0.0
    for push in pushes:
        seen, *_ = env.step(np.array([volts + push]))
        state = plant.A @ state + plant.B[:, 0] * push
        worst = max(worst, np.abs(seen[:3] - rest[:3] - plant.C @ state).max())
    # Single precision of the observation, and the curvature of friction.
    assert worst < 1e-5 and np.abs(plant.C @ state).max() > 1e-4


def test_open_loop_poles_of_the_sampled_rig_are_those_of_the_analytic_matrix():
    rig, setpoint = Rig(), 4.0
    slope = (
        rig.bl
        + 0.5 * rig.T1 * rig.beta1 / np.cosh(0.5 * rig.beta1 * setpoint) ** 2
        + 0.5 * rig.T2 * rig.beta2 / np.cosh(0.5 * rig.beta2 * setpoint) ** 2
    )
    damping = [(rig.bu + rig.dbu) / rig.Ju, slope / rig.Jl]
    stiff = [rig.ktheta / rig.Ju, rig.ktheta / rig.Jl]
    # Characteristic polynomial of (twist, omega_u, omega_l), by hand.
    analytic = np.roots(
        [1.0, sum(damping), damping[0] * damping[1] + sum(stiff),
         stiff[0] * damping[1] + stiff[1] * damping[0]]
    )  # fmt: skip
    held = ct.StateSpace([[0.0]], [[0.0, 0.0, 0.0]], [[0.0]], [[0.0, 0.0, 0.0]], 0.05)
    found = closed_poles(held, sampled_rig(CONFIG, setpoint))
    for pole in analytic:
        assert np.abs(found - pole).min() < 1e-8


def test_realised_pi_is_its_transfer_function():
    pi = baselines.SpeedPI(CONFIG)
    found = realise(pi, CONFIG, 3.0)
    z = np.exp(1j * OMEGA * 0.05)
    # The integral counts the present error, so that it leads the plain sum by a period.
    analytic = -(pi.kp + pi.ki * 0.05 * z / (z - 1.0))
    assert response(found)[:, 0, 0] == pytest.approx(analytic, rel=1e-5)


@pytest.mark.parametrize("name", ["lqr", "lqi", "lqg", "h-infinity"])
def test_realised_law_is_the_designed_one(name):
    controller = baselines.make(name, CONFIG)
    setpoint = 1.02 ** round(np.log(3.0) / np.log(1.02))
    designed = controller.law(setpoint).unclipped(0.05)
    found = response(realise(controller, CONFIG, setpoint))
    truth = response(designed)
    assert np.abs(found - truth).max() < 1e-3 * np.abs(truth).max()


def test_filter_gain_is_where_the_riccati_recursion_settles():
    system = surface_part(sampled_rig(CONFIG, 2.0))
    process, noise = torque_noise(system, 0.01, 0.05), noise_levels(CONFIG)[1:2]
    p = np.eye(len(system.A))
    for _ in range(4000):
        gain = p @ system.C.T @ np.linalg.inv(system.C @ p @ system.C.T + noise**2)
        p = system.A @ (p - gain @ system.C @ p) @ system.A.T + process
    found = filter_gain(system, process, noise)
    assert found == pytest.approx(gain, rel=1e-4, abs=1e-6)


def test_noise_level_is_that_of_a_slowly_turning_encoder():
    env = DrillStringEnv(setpoint=3.0137, start="equilibrium", episode_seconds=300.0)
    env.reset(seed=0)
    volts = np.array([float(equilibrium_voltage(Rig(), 3.0137))])
    pairs = []
    for _ in range(400):
        seen, _, _, _, info = env.step(volts)
        pairs.append((seen[1], info["omega_u"]))
    measured, true = np.array(pairs).T
    assert np.std(measured - true) == pytest.approx(noise_levels(CONFIG)[1], rel=0.5)


def observations(rng, scale, n):
    setpoint = rng.uniform(1.0, 7.0, n)
    state = np.array([equilibrium_state(Rig(), w)[:3] for w in setpoint])
    volts = equilibrium_voltage(Rig(), setpoint)
    seen = state + scale * rng.standard_normal((n, 3))
    return np.column_stack([seen, setpoint, volts])


def test_mpc_is_the_lqi_while_no_limit_is_met_and_the_best_plan_where_one_is():
    gains = baselines.CONTROLLERS["lqi"].keywords
    mpc, lqi = baselines.MPC(CONFIG, sweeps=4000, **gains), baselines.LQI(CONFIG, **gains)
    rng = np.random.default_rng(0)
    near = observations(rng, 1e-2, 8)
    for controller in (mpc, lqi):
        controller.reset(8)
    for _ in range(20):
        assert mpc.act(near) == pytest.approx(lqi.act(near), abs=1e-9)
    far = observations(rng, 3.0, 8)
    mpc.reset(8)
    chosen = mpc.act(far)
    states = np.zeros((8, mpc._memory.shape[1]))
    assert (np.abs(chosen) == 5.0).any() and (np.abs(chosen) < 5.0).any()
    for i in range(8):
        pull, hessian, _, _, correct = (part[mpc._index[i]] for part in mpc._tables)
        states[i, :-1] = correct @ (far[i, :3] - mpc._references[i])
        # The same programme as bounded least squares: 0.5 |R u + R^-T G'x|^2.
        root = np.linalg.cholesky(hessian).T
        goal = -np.linalg.solve(root.T, states[i] @ pull)
        bounds = (-5.0 - mpc._volts[i], 5.0 - mpc._volts[i])
        best = lsq_linear(root, goal, bounds, method="bvls", tol=1e-12).x[0]
        assert chosen[i] == pytest.approx(mpc._volts[i] + best, abs=2e-2)


def test_h_infinity_reaches_the_peak_it_claims():
    controller = baselines.make("h-infinity", CONFIG)
    law, peak = controller.continuous(2.0)
    closed = controller.generalised(2.0).lft(law, 1, 1)
    assert closed.poles().real.max() < 0.0
    omega = np.geomspace(1e-6, 1e4, 2000)
    gains = [np.linalg.norm(closed(1j * w), 2) for w in omega]
    assert max(gains) <= peak * 1.01 and max(gains) > 0.5 * peak


def test_popov_holds_for_the_observer_and_not_without_feedback():
    made = baselines.make("set-valued-observer", CONFIG)
    assert made.popov_margin() > 0.1
    made.feedback = np.zeros(3)
    assert made.popov_margin() < 0.0


def test_no_linear_law_from_the_surface_is_less_sensitive_than_the_bound():
    assert surface_bound(Rig(), 0.5) == 1.0
    assert max(surface_bound(Rig(), w) for w in np.arange(0.9, 8.5, 0.1)) == pytest.approx(
        10.6, abs=0.05
    )
    facts = design_facts(baselines.CONTROLLERS["lqg"], CONFIG, (1.5, 3.0, 6.0))
    assert facts.stable.all()
    for row in facts.itertuples():
        assert row.sensitivity_peak > surface_bound(Rig(), row.setpoint)


def test_a_loop_beyond_its_gain_or_delay_margin_is_unstable():
    law, plant = realise(baselines.make("lqi", CONFIG), CONFIG, 2.0), sampled_rig(CONFIG, 2.0)
    row = design_facts(baselines.CONTROLLERS["lqi"], CONFIG, (2.0,)).iloc[0]
    for gain, stable in ((row.gain_margin * 0.98, True), (row.gain_margin * 1.02, False)):
        scaled = ct.StateSpace(law.A, law.B, gain * law.C, gain * law.D, law.dt)
        assert (closed_poles(scaled, plant).real.max() < 0.0) == stable
    whole = int(row.delay_margin_s / 0.05)
    for periods, stable in ((whole, True), (whole + 1, False)):
        held = ct.StateSpace(
            np.eye(periods, k=1), np.eye(periods)[:, -1:], np.eye(periods)[:1], 0, 0.05
        )
        assert (closed_poles(held * law, plant).real.max() < 0.0) == stable


def test_facts_tell_what_the_exact_simulation_does():
    quiet = dataclasses.replace(CONFIG, encoder=Encoder(counts_per_rev=0), rtol=1e-9)
    row = design_facts(baselines.CONTROLLERS["pi"], quiet, (2.0,)).iloc[0]
    assert not row.stable and np.isnan(row.gain_margin)
    free = design_facts(baselines.CONTROLLERS["active-damping"], quiet, (2.0,)).iloc[0]
    assert free.stable and free.sensitivity_peak > 1.0


@pytest.mark.parametrize("name", ["adaptive-ekf", "adaptive-ekf-told"])
def test_a_filter_that_learns_has_no_margins(name):
    with pytest.raises(InputError, match="no linear law"):
        realise(baselines.make(name, CONFIG), CONFIG, 2.0)


def filter_state(rng):
    x = np.zeros(kernels.N)
    x[:3] = 1.3, 2.2, 1.7
    x[kernels.PAST : kernels.FREE] = 2.0 + 0.1 * rng.standard_normal(kernels.N_PAST)
    x[kernels.FREE :] = 0.05, 0.02, 0.1, -0.1, 0.08, 0.03, 0.06
    return x


def carried(x, volts, top):
    nominal = kernel_record(Rig())
    p, new = nominal.copy(), x.copy()
    kernels.set_plant(p[0], nominal[0], new)
    kernels.predict_state(p[0], new, volts, 0.05, top)
    return new


def test_filter_linearises_and_spreads_as_finite_differences_say():
    rng = np.random.default_rng(2)
    x, top = filter_state(rng), np.zeros((3, kernels.N_TOP))
    full = np.zeros((kernels.N, kernels.N))
    scratch = np.zeros_like(top)
    for k in range(kernels.N):
        step = np.zeros(kernels.N)
        step[k] = 1e-6
        ahead, behind = (carried(x + s * step, 1.4, scratch) for s in (1.0, -1.0))
        full[:, k] = (ahead - behind) / 2e-6
    carried(x, 1.4, top)
    shown = [0, 1, 2, *range(kernels.FREE, kernels.N)]
    # The implicit part of friction counts as constant.
    assert top == pytest.approx(full[:3][:, shown], rel=2e-3, abs=2e-5)
    root = rng.standard_normal((kernels.N, kernels.N))
    cov, process = root @ root.T, rng.random(kernels.N)
    exact = full.copy()
    exact[:3][:, shown] = top
    expected = exact @ cov @ exact.T + np.diag(process)
    kernels.predict_covariance(cov, top, process, np.zeros((6, kernels.N)))
    assert cov == pytest.approx(expected, rel=1e-6, abs=1e-6)


def test_riccati_recursion_settles_on_the_regulator():
    p = kernel_record(Rig())[0]
    a, b, k = np.zeros((3, 3)), np.zeros(3), np.zeros(3)
    regulator.plant_step(p, 2.0, 0.05, a, b)
    value = np.eye(3)
    for _ in range(3000):
        regulator.riccati_step(a, b, value, 0.7, 2.0, k, np.zeros((4, 3)))
    weight = np.array([[0.0, 0.0, 0.0], [0.0, 0.7, -0.7], [0.0, -0.7, 1.7]])
    best = np.asarray(ct.dlqr(a, b[:, None], weight, [[2.0]])[0])[0]
    assert k == pytest.approx(best, rel=1e-6)


def test_adaptive_filter_learns_the_plant_it_is_not_told():
    plants = frozen_plants("L2", 6)
    controller = baselines.make("adaptive-ekf", CONFIG)
    config = dataclasses.replace(CONFIG, episode_seconds=60.0)
    runs = run_plants(controller, config, plants, np.array([4.0]), "limit_cycle")
    found = controller.believed()
    off = np.abs(found["viscous"] / plants.factors[:, 3] - 1.0)
    assert off.max() < 0.04 < np.abs(plants.factors[:, 3] - 1.0).max()
    assert np.abs(runs.omega_l[-200:] / 4.0 - 1.0).max() < 0.1


@pytest.mark.parametrize("name", list(baselines.CONTROLLERS))
def test_each_rig_is_driven_as_if_it_were_alone(name):
    config = dataclasses.replace(CONFIG, episode_seconds=6.0)
    plants, setpoints = frozen_plants("L1", 2), np.array([1.0, 6.0])
    together = run_plants(baselines.make(name, config), config, plants, setpoints, "limit_cycle")
    again = run_plants(baselines.make(name, config), config, plants, setpoints, "limit_cycle")
    assert np.array_equal(together.voltage, again.voltage)
    assert np.abs(together.voltage).max() <= 5.0 and np.ptp(together.voltage) > 0.0
    first = dataclasses.replace(plants, factors=plants.factors[:1])
    alone = run_plants(baselines.make(name, config), config, first, setpoints[:1], "limit_cycle")
    assert alone.voltage[:, 0] == pytest.approx(together.voltage[:, 0], abs=1e-6)


@pytest.mark.parametrize("name", list(baselines.CONTROLLERS))
def test_recalled_memory_continues_the_run(name):
    made, other = (baselines.make(name, CONFIG) for _ in range(2))
    if not hasattr(made, "recall"):
        assert name in ("open-loop", "z-torque") or name.startswith("adaptive")
        return
    seen = observations(np.random.default_rng(4), 0.1, 12)
    seen[:, 3] = seen[0, 3]
    if made.view == "surface":
        seen = seen[:, [1, 3, 4]]
    made.reset(1)
    for row in seen[:6]:
        made.act(row[None])
    other.reset(1)
    other.act(seen[:1])
    other.recall(made.memory())
    for row in seen[6:]:
        assert other.act(row[None]) == pytest.approx(made.act(row[None]), abs=1e-9)


def test_unknown_unknowns_are_refused():
    with pytest.raises(InputError, match="'mass'"):
        baselines.AdaptiveEKF(CONFIG, unknown=("mass",))


def test_gains_lie_in_the_ranges_they_were_searched_in():
    from drill_env.baselines.gains import tuned_gains

    for name, item in baselines.TUNABLE.items():
        gains = tuned_gains(name)
        assert set(gains) == set(item.ranges), name
        for gain, value in gains.items():
            low, high = item.ranges[gain]
            assert low * 0.999 <= value <= high * 1.001, (name, gain)
