"""Physics that multiplies a drive, a friction or a spring is told as such, over its coordinate."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.rig_maker import quasi_random
from drill_env import Rig
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.effects import LIBRARY
from drill_env.integrator import sampled_voltage, simulate
from drill_env.recordings import Recording

RATE, STEP = 200.0, 2.0 * np.pi / 8192
KEPT = {"motor_heating", "supply_sag", "upper_quadratic_drag", "string_hardening", "whirl_drag"}
X = np.linspace(-15.0, 15.0, 301)
# Component, coordinate, sort and values over X; a string softens over the 30 s of each recording.
PRODUCTS = {
    "a motor that weakens with speed": ("upper", "omega_u", "drive", -0.02 * np.abs(X)),
    "a brake that a twisted string lifts": (
        "lower", "twist", "friction", 1.0 / (1.0 + 0.02 * X**2) - 1.0
    ),
    "a string that softens": ("string", "time", "stiffness", -0.01 * np.clip(X, 0.0, 15.0)),
}  # fmt: skip


def recorded(effect: dict, seed: int) -> Recording:
    """Readings of the exact integrator, whose tables are held against scipy elsewhere."""
    t = np.arange(6000) / RATE
    rng = np.random.default_rng([14, seed])
    u = quasi_random(rng, 30.0, RATE, 5.0)
    # Torques that nobody recorded, about as large as the rig's own.
    played = u + rng.normal(0.0, 0.02, len(t))
    knots = np.arange(0.0, 31.0, 0.1)
    rough = {
        "id": "table", "component": "lower", "depends_on": "time", "sort": "torque",
        "knots": knots.tolist(), "values": rng.normal(0.0, 2e-4, len(knots)).tolist(),
    }  # fmt: skip
    run = simulate(Rig(effects=(effect, rough)), sampled_voltage(t, played), t[-1], t_eval=t)
    angles = [np.round(a / STEP) * STEP for a in (run.theta_u, run.theta_l)]
    return Recording(
        t, u, *angles, quanta={"theta_u": STEP, "theta_l": STEP}, source=f"made-{seed}"
    )


@pytest.mark.parametrize("name", PRODUCTS)
def test_a_product_is_told_over_its_coordinate(name: str):
    component, coordinate, sort, values = PRODUCTS[name]
    effect = {
        "id": "table", "component": component, "depends_on": coordinate, "sort": sort,
        "knots": X.tolist(), "values": values.tolist(),
    }  # fmt: skip
    made = [recorded(effect, seed) for seed in range(3)]
    options = DiagnosisOptions(leave_out=tuple(sorted(set(LIBRARY) - KEPT)), most=1)
    result = diagnose(made[:2], Rig(), made[2:], options=options).result
    assert result.verdict == "unexplained" and result.shape is not None
    assert result.located is not None
    assert (result.located.component, result.shape.coordinate) == (component, coordinate)
    assert result.shape.sort == sort
    errors = result.fit["five_second_prediction"]["theta_l"]
    assert errors["after_rms"] < 0.2 * errors["before_rms"]
