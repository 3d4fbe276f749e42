"""Physics that no library lists is told where it acts, over its coordinate, as what it does.

What multiplies a drive, a friction or a spring; a joint that turns the string's torque; the play
of an encoder.
"""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.rig_maker import quasi_random
from drill_env import Rig
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.diagnosis.result import DiagnosisResult
from drill_env.effects import LIBRARY
from drill_env.integrator import sampled_voltage, simulate
from drill_env.recordings import Recording

RATE, STEP = 200.0, 2.0 * np.pi / 8192
KEPT = {
    "encoder_delay_lower",
    "torque_ripple",
    "gear_eccentricity",
    "motor_heating",
    "supply_sag",
    "upper_quadratic_drag",
    "string_hardening",
    "whirl_drag",
}
X = np.linspace(-15.0, 15.0, 301)
# Component, coordinate, sort and values over X; a string softens over the 30 s of each recording.
PRODUCTS = {
    "a motor that weakens with speed": ("upper", "omega_u", "drive", -0.02 * np.abs(X)),
    "a brake that a twisted string lifts": (
        "lower", "twist", "friction", 1.0 / (1.0 + 0.02 * X**2) - 1.0
    ),
    "a string that softens": ("string", "time", "stiffness", -0.01 * np.clip(X, 0.0, 15.0)),
}  # fmt: skip


def played(angle: np.ndarray, half: float) -> np.ndarray:
    """What an encoder reads whose shaft follows with a play of twice `half`."""
    out = np.empty_like(angle)
    at = angle[0]
    for k, true in enumerate(angle):
        at = min(max(at, true - half), true + half)
        out[k] = at
    return out


def recorded(effects: tuple[dict, ...], seed: int, play: float = 0.0) -> Recording:
    """Readings of the exact integrator, whose tables are held against scipy elsewhere."""
    t = np.arange(6000) / RATE
    rng = np.random.default_rng([14, seed])
    u = quasi_random(rng, 30.0, RATE, 5.0)
    # Torques that nobody recorded, about as large as the rig's own.
    driven = u + rng.normal(0.0, 0.02, len(t))
    knots = np.arange(0.0, 31.0, 0.1)
    rough = {
        "id": "table", "component": "lower", "depends_on": "time", "sort": "torque",
        "knots": knots.tolist(), "values": rng.normal(0.0, 2e-4, len(knots)).tolist(),
    }  # fmt: skip
    run = simulate(Rig(effects=(*effects, rough)), sampled_voltage(t, driven), t[-1], t_eval=t)
    angles = [np.round(a / STEP) * STEP for a in (run.theta_u, played(run.theta_l, play))]
    return Recording(
        t, u, *angles, quanta={"theta_u": STEP, "theta_l": STEP}, source=f"made-{seed}"
    )


def told(made: list[Recording]) -> DiagnosisResult:
    """The diagnosis of all but the last recording by a library of few names, the last held out."""
    options = DiagnosisOptions(leave_out=tuple(sorted(set(LIBRARY) - KEPT)), most=1)
    return diagnose(made[:-1], Rig(), made[-1:], options=options).result


@pytest.mark.parametrize("name", PRODUCTS)
def test_a_product_is_told_over_its_coordinate(name: str):
    component, coordinate, sort, values = PRODUCTS[name]
    effect = {
        "id": "table", "component": component, "depends_on": coordinate, "sort": sort,
        "knots": X.tolist(), "values": values.tolist(),
    }  # fmt: skip
    result = told([recorded((effect,), seed) for seed in range(3)])
    assert result.verdict == "unexplained" and result.shape is not None
    assert result.located is not None
    assert (result.located.component, result.shape.coordinate) == (component, coordinate)
    assert result.shape.sort == sort
    errors = result.fit["five_second_prediction"]["theta_l"]
    assert errors["after_rms"] < 0.2 * errors["before_rms"]


def test_a_joint_at_the_top_of_the_string_is_told_by_the_order_of_its_torque():
    """A misaligned universal joint turns the string's torque twice a turn of the upper disc."""
    turn = np.linspace(0.0, np.pi, 65)[:-1]
    joint = {
        "id": "table", "component": "string", "depends_on": "theta_u", "sort": "torque",
        "period": float(np.pi), "knots": turn.tolist(),
        "values": (0.01 * np.sin(2.0 * turn + 0.7)).tolist(),
    }  # fmt: skip
    result = told([recorded((joint,), seed) for seed in range(3)])
    assert result.verdict == "unexplained" and result.located is not None
    assert (result.located.component, result.located.equation) == ("string", "both")
    assert result.located.depends_on == "theta_u"
    assert result.located.angle_order == pytest.approx(2.0, abs=0.002)
    assert result.shape is not None
    assert max(result.shape.values) == pytest.approx(0.01, rel=0.05)
    errors = result.fit["five_second_prediction"]["theta_l"]
    assert errors["after_rms"] < 0.2 * errors["before_rms"]


def test_the_play_of_an_encoder_is_told_over_the_direction_it_turns():
    result = told([recorded((), seed, play=0.01) for seed in range(3)])
    assert result.verdict == "unexplained" and result.shape is not None
    assert result.located is not None
    assert (result.located.component, result.shape.coordinate) == ("sensor", "omega_l")
    errors = result.fit["five_second_prediction"]["theta_l"]
    assert errors["after_rms"] < 0.85 * errors["before_rms"]
