"""A lower angle that was made of the upper one and a measured twist has the noise of both."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from drill_env import Rig
from drill_env.identification.noise import NoiseModel, shiver
from drill_env.identification.prediction_error import value_of
from drill_env.identification.readings import made_of_twist
from drill_env.identification.samples import prepare
from drill_env.recordings import Recording

COUNT = 2.0 * math.pi / 2000
# No dry friction: what the set-valued filter does is a Kalman filter, and a textbook's will do.
LINEAR = Rig().replace(
    friction="coulomb", km=0.4, Ju=6e-3, Tsu=0.0, dTsu=0.0, bu=0.08, dbu=0.0, Jl=8e-3, ktheta=3.0,
    Tsl=0.0, bl=5e-4,
)  # fmt: skip
NOISE = NoiseModel(
    torque_u=0.02, torque_l=3e-3, tau_u=0.1, tau_l=0.05, encoder_u=9e-4, encoder_l=1.3e-3
)
RATE = 200.0
# Fast enough that no sample turns a disc round, where the filter would stop it.
BEGUN = np.array([0.0, 25.0, 25.0, 0.0, 0.0, 0.0])


def matrices(rig: Rig, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Of (twist, omega_u, omega_l, theta_l, d_u, d_l) and voltage over one interval, held."""
    a = np.zeros((7, 7))
    a[0, 1], a[0, 2], a[3, 2] = 1.0, -1.0, 1.0
    a[1] = np.array([-rig.ktheta, -rig.bu, 0.0, 0.0, 1.0, 0.0, rig.km]) / rig.Ju
    a[2] = np.array([rig.ktheta, 0.0, -rig.bl, 0.0, 0.0, 1.0, 0.0]) / rig.Jl
    whole = expm(a * dt)
    whole[4, 4], whole[5, 5] = math.exp(-dt / NOISE.tau_u), math.exp(-dt / NOISE.tau_l)
    return whole[:6, :6], whole[:6, 6]


def played(seed: int, *, from_hub: bool) -> Recording:
    """A run of the linear rig, its twist read from the hub or its lower angle by itself."""
    rng = np.random.default_rng(seed)
    n = 2000
    step, push = matrices(LINEAR, 1.0 / RATE)
    u = 5.0 + np.repeat(rng.uniform(-1.0, 1.0, n // 40), 40)
    x, states = BEGUN.copy(), np.zeros((n, 6))
    sizes = (NOISE.torque_u, NOISE.torque_l)
    x[4:] = rng.normal(size=2) * sizes
    for k in range(n):
        states[k] = x
        x = step @ x + push * u[k]
        x[4:] += rng.normal(size=2) * sizes * np.sqrt(1.0 - np.diag(step)[4:] ** 2)
    upper = states[:, 0] + states[:, 3] + NOISE.encoder_u * rng.normal(size=n)
    noise = NOISE.encoder_l * rng.normal(size=n)
    lower = upper - states[:, 0] + noise if from_hub else states[:, 3] + noise
    return Recording(np.arange(n) / RATE, u, upper, lower)


def textbook(run: Recording) -> float:
    """Minus twice the log likelihood by a joint update with the noise that both readings share."""
    step, push = matrices(LINEAR, 1.0 / RATE)
    read = np.zeros((2, 6))
    read[0, [0, 3]] = read[1, 3] = 1.0
    shared = NOISE.encoder_u**2
    r = np.array([[shared, shared], [shared, shared + NOISE.encoder_l**2]])
    q = np.zeros((6, 6))
    q[4, 4] = NOISE.torque_u**2 * (1.0 - step[4, 4] ** 2)
    q[5, 5] = NOISE.torque_l**2 * (1.0 - step[5, 5] ** 2)
    x, p, value = BEGUN.copy(), np.diag([0, 0, 0, 0, NOISE.torque_u**2, NOISE.torque_l**2]), 0.0
    for u, upper, lower in zip(run.u, run.theta_u, run.theta_l, strict=True):
        gap, s = np.array([upper, lower]) - read @ x, read @ p @ read.T + r
        value += gap @ np.linalg.solve(s, gap) + np.linalg.slogdet(s)[1]
        gain = p @ read.T @ np.linalg.inv(s)
        x, p = x + gain @ gap, p - gain @ read @ p
        x, p = step @ x + push * u, step @ p @ step.T + q
    return float(value)


def test_likelihood_is_that_of_a_joint_update_with_shared_noise() -> None:
    run = played(1, from_hub=True)
    samples = replace(prepare(run, LINEAR, relative=True), release=0.0)
    starts = np.array([[*BEGUN[:4], 0.0]])
    truth = textbook(run)
    assert value_of(samples, LINEAR, NOISE, starts) == pytest.approx(truth, abs=1e-2)
    # Taken for apart, the noise of the hub counts twice: thousands of times less likely.
    assert value_of(replace(samples, relative=False), LINEAR, NOISE, starts) > truth + 100.0


@pytest.mark.parametrize("from_hub", [True, False])
@pytest.mark.parametrize("counted", [True, False])
def test_the_noise_itself_tells_how_the_lower_angle_was_made(from_hub: bool, counted: bool) -> None:
    run = played(2, from_hub=from_hub)
    if counted:
        upper = COUNT * np.round(run.theta_u / COUNT)
        lower = upper + (run.theta_l - run.theta_u) if from_hub else run.theta_l
        run = replace(run, theta_u=upper, theta_l=COUNT * np.round(lower / COUNT))
    assert made_of_twist([run]) == from_hub
    assert prepare(run, LINEAR).relative == from_hub


def test_a_clock_that_jitters_makes_no_sensor_of_the_twist() -> None:
    """Its errors are alike in both angles where the discs turn as fast."""
    rng = np.random.default_rng(5)
    run = played(2, from_hub=False)
    late = 2.5e-3 * rng.normal(size=len(run))
    upper, lower = (
        theta + late * np.gradient(theta, run.t) for theta in (run.theta_u, run.theta_l)
    )
    assert abs(np.corrcoef(np.diff(upper, 8), np.diff(lower, 8))[0, 1]) > 0.5
    assert not made_of_twist([replace(run, theta_u=upper, theta_l=lower)])


def test_white_noise_is_told_beside_a_resonance_and_outliers() -> None:
    rng = np.random.default_rng(3)
    t = np.arange(4000) / RATE
    read = 0.2 * np.sin(2.0 * math.pi * 6.0 * t) + 1e-3 * rng.normal(size=len(t))
    read[::250] += 0.5
    read[100] = math.nan
    assert shiver(read) == pytest.approx(1e-3, rel=0.1)
    assert shiver(COUNT * np.ones(100)) == 0.0
