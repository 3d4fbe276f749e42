"""A servo pendulum: one axis that carries a weight its model does not know."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from drill_env import Rig
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.effects import LIBRARY
from drill_env.integrator import simulate
from drill_env.recordings import Recording

AXIS = Rig.one_inertia(km=0.3, Ju=0.02, Tsu=0.03, bu=0.03)
WEIGHT = 0.6
RATE, STEP = 200.0, 2.0 * math.pi / 4096
KEPT = {
    "upper_unbalance", "upper_stribeck", "upper_presliding", "upper_quadratic_drag",
    "upper_disturbance", "gain_asymmetry", "motor_heating",
}  # fmt: skip


@pytest.mark.parametrize("swing", [0.1, 1.0, 2.5])
def test_it_swings_with_the_period_of_a_pendulum(swing):
    """Without friction, 4 sqrt(J/w) K(sin(swing/2)^2); elliptic integral of SciPy."""
    effect = {"id": "upper_unbalance", "torque": WEIGHT, "phase": 0.5 * math.pi - swing}
    rig = Rig.one_inertia(km=0.3, Ju=0.02, Tsu=0.0, bu=0.0).replace(effects=(effect,))
    t = np.linspace(0.0, 4.0, 4001)
    theta = simulate(rig, 0.0, t[-1], t_eval=t).theta_u
    # It starts at rest, a swing away from where it hangs.
    away = theta - swing
    up = np.flatnonzero((away[:-1] < 0.0) & (away[1:] >= 0.0))[:2]
    times = [np.interp(0.0, away[i : i + 2], t[i : i + 2]) for i in up]
    period = 4.0 * math.sqrt(0.02 / WEIGHT) * ellipk(math.sin(0.5 * swing) ** 2)
    assert times[1] - times[0] == pytest.approx(period, rel=1e-4)


def recorded(seed: int, seconds: float = 20.0) -> Recording:
    """The pendulum by SciPy, its friction resting where it can, under levels of voltage."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(seconds * RATE)) / RATE
    u = np.repeat(rng.uniform(-1.6, 1.6, int(seconds) + 1), int(RATE))[: len(t)]
    push = rng.normal(0.0, 0.005, len(t))
    theta, state = np.zeros(len(t)), np.zeros(2)
    for i in range(len(t)):
        theta[i] = state[0]

        def slope(_: float, y: np.ndarray, k: int = i) -> list[float]:
            drive = 0.3 * u[k] + push[k] - WEIGHT * math.sin(y[0])
            # Tanh as steep as counts of speed: no code of the package's, and near enough here.
            return [y[1], (drive - 0.03 * math.tanh(y[1] / 1e-3) - 0.03 * y[1]) / 0.02]

        state = solve_ivp(slope, (0.0, 1.0 / RATE), state, "LSODA", rtol=1e-6, atol=1e-8).y[:, -1]
    read = STEP * np.round(theta / STEP)
    return Recording(t, u, read, quanta={"theta_u": STEP}, source=f"pendulum-{seed}")


@pytest.fixture(scope="module")
def pendulums() -> list[Recording]:
    return [recorded(seed) for seed in (1, 2, 3)]


def test_the_weight_is_named_and_measured(pendulums):
    options = DiagnosisOptions(
        leave_out=tuple(sorted(set(LIBRARY) - KEPT)), most=1, given_rig=True, doubt=0.2
    )
    found = diagnose(pendulums[:2], AXIS, pendulums[2:], options=options)
    (effect,) = found.result.effects
    assert effect.id == "upper_unbalance"
    assert effect.parameters["torque"].value == pytest.approx(WEIGHT, rel=0.05)
    assert effect.parameters["phase"].value == pytest.approx(0.5 * math.pi, abs=0.02)
    errors = found.result.fit["prediction"]["theta_u"]
    assert errors["after_rms"][-1] < 0.1 * errors["before_rms"][-1]
