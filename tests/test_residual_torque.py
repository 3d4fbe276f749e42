"""The residual of a fit: noise is not predictable, physics of no library is."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lfilter

from drill_env import Rig
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.residual_torque import (
    PREDICTABLE,
    Latent,
    ResidualTorque,
    residual_torque_of,
)
from drill_env.diagnosis.unexplained_residual import removes_too_little
from drill_env.effects.along import Motion
from drill_env.integrator import sampled_voltage, simulate
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.families import family_of
from drill_env.recordings import Recording

RATE = 200.0
AXIS = Rig.one_inertia(km=0.54, Ju=0.029, Tsu=0.29, bu=0.24)


def volts(seed: int, seconds: float, low: float, high: float) -> np.ndarray:
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds * RATE)) / RATE
    return rng.uniform(low, high, round(seconds))[(t + 1e-9).astype(int)]


def moved(seed: int) -> Motion:
    """The paper's rig as the simulator has it, under steps of the voltage."""
    u = volts(seed, 30.0, -4.0, 4.0)
    t = np.arange(len(u)) / RATE
    run = simulate(
        Rig.paper().replace(clamp=True), sampled_voltage(t, u), t[-1] + 1 / RATE, t_eval=t
    )
    states = np.column_stack([run.state, np.gradient(run.state[:, 1:3], t, axis=0)])
    return Motion(t, u, states, np.array([0]))


@pytest.fixture(scope="module")
def motions():
    return [moved(seed) for seed in range(3)]


def noise(rng, n, size):
    """Coloured as the filter's latent torques are, of about a fifth of a second."""
    keep = math.exp(-5.0 / RATE)
    return lfilter([1.0], [1.0, -keep], rng.normal(0.0, size * math.sqrt(1.0 - keep**2), n))


@pytest.mark.parametrize("count", [1, 3])
def test_coloured_noise_is_not_predictable(motions, count):
    rng = np.random.default_rng(count)
    latents = [
        Latent(m, np.column_stack([noise(rng, len(m.t), size) for size in (0.02, 1e-4)]))
        for m in motions[:count]
    ]
    left = residual_torque_of(latents)
    assert max(left.shares) < 0.25 * PREDICTABLE
    assert left.sizes == pytest.approx((0.02, 1e-4), rel=0.2)


@pytest.mark.parametrize("share", [0.5, 0.9])
def test_the_share_is_that_of_the_signal(motions, share):
    """A torque over the upper angle's turn in noise: no model predicts more than its share."""
    rng = np.random.default_rng(7)
    latents = []
    for m in motions:
        angle = m.states[:, 3] + m.states[:, 0]
        signal = math.sqrt(2.0 * share) * np.sin(2.0 * angle + 0.4)
        upper = signal + noise(rng, len(m.t), math.sqrt(1.0 - share))
        latents.append(Latent(m, np.column_stack([upper, np.zeros(len(m.t))])))
    left = residual_torque_of(latents)
    # What is learnt from coloured noise costs some of it.
    assert share - 0.25 < left.shares[0] < share + 0.05
    assert left.shares[1] == 0.0 and left.sizes[1] == 0.0


def yoked(seed: int, swing: float) -> Recording:
    """One axis with a mass that a scotch yoke drives: its inertia is Ju - swing cos(2 theta).

    By another solver; the voltage keeps it turning one way, so dry friction is constant.
    """
    u = volts(seed, 20.0, 1.2, 4.0)
    t = np.arange(len(u)) / RATE
    rig = AXIS

    def slope(now: float, y: np.ndarray, volt: float) -> list[float]:
        theta, omega = y
        torque = rig.km * volt - rig.Tsu - rig.bu * omega - swing * math.sin(2 * theta) * omega**2
        return [omega, torque / (rig.Ju - swing * math.cos(2 * theta))]

    y, angles = np.array([0.0, (rig.km * u[0] - rig.Tsu) / rig.bu]), []
    for volt in u:
        angles.append(y[0])
        y = solve_ivp(slope, (0.0, 1 / RATE), y, args=(volt,), rtol=1e-8, atol=1e-10).y[:, -1]
    read = np.array(angles) + np.random.default_rng(seed).normal(0.0, 2e-4, len(t))
    return Recording(t, u, theta_u=read, source=f"yoke-{seed}")


def test_an_inertia_that_changes_over_the_angle_is_located():
    """No effect of the library is this physics; a drive that varies with the angle stands in."""
    *fit, held = (yoked(seed, 0.008) for seed in range(3))
    result = diagnose(fit, AXIS, [held]).result
    assert result.verdict in ("unexplained", "missing_physics")
    assert result.grades is not None and result.grades.depends_on == "theta_u"
    for effect in result.effects:
        assert family_of(effect.id) == "drive that varies with the angle"
        assert effect.parameters["order"].value == pytest.approx(2.0, abs=0.05)


def test_without_the_yoke_nothing_is_missing():
    *fit, held = (yoked(seed, 0.0) for seed in range(3))
    assert diagnose(fit, AXIS, [held]).result.verdict == "consistent"


@pytest.mark.parametrize(
    ("left", "alone", "place", "rejected"),
    [
        # The motion predicts as much as before: the name is a surrogate.
        (((-0.2, 0.79), (1e-3, 0.017)), ((-0.2, 0.84), (1e-3, 0.017)), "lower", True),
        # Another law than the name's is in what little is left.
        (((-0.2, 0.69), (1e-3, 0.001)), ((-0.2, 0.92), (1e-3, 0.020)), "lower", False),
        # What is left is large, and noise.
        (((-0.2, 0.15), (1e-3, 0.017)), ((-0.2, 0.84), (1e-3, 0.017)), "lower", False),
        # It is right at one disc and spoils the other.
        (((0.6, -0.1), (0.010, 0.001)), ((0.3, 0.9), (0.002, 0.020)), "lower", True),
        # A little that the other disc had before is no reason against a name at this one.
        (((-0.1, 0.50), (0.046, 0.0021)), ((0.03, 0.50), (1.3, 0.0021)), "upper", False),
        # An angle that is misread seems a torque on either disc.
        (((-0.1, 0.50), (0.046, 0.0021)), ((0.03, 0.50), (1.3, 0.0021)), "sensor", True),
    ],
)
def test_names_must_remove_what_is_predictable(left, alone, place, rejected):
    now, then = ResidualTorque(*left), ResidualTorque(*alone)
    assert removes_too_little(now, then, {place}, Criteria()) is rejected
