"""A spring that pulls an axis back is named, with a centre on either side of 0."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drill_env import Rig
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.effects import LIBRARY
from drill_env.integrator import sampled_voltage, simulate
from drill_env.recordings import Recording

AXIS = Rig.one_inertia(km=0.3, Ju=0.02, Tsu=0.03, bu=0.03)
RATE, STEP = 200.0, 2.0 * math.pi / 4096
STIFFNESS, CENTRE = 0.1, -2.0
KEPT = {
    "upper_spring", "upper_unbalance", "upper_stribeck", "upper_quadratic_drag",
    "upper_load_friction", "motor_fade", "upper_resonator",
}  # fmt: skip


def recorded(seed: int, seconds: float = 10.0) -> Recording:
    """The axis under levels of voltage, with a torque that nobody knows."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(seconds * RATE)) / RATE
    u = np.repeat(rng.uniform(-1.6, 1.6, int(seconds)), int(RATE))
    spring = {"id": "upper_spring", "stiffness": STIFFNESS, "centre": CENTRE}
    drive = sampled_voltage(t, u + rng.normal(0.0, 0.005, len(t)) / AXIS.km)
    run = simulate(AXIS.replace(effects=(spring,)), drive, t[-1], t_eval=t)
    read = STEP * np.round(run.theta_u / STEP)
    return Recording(t, u, read, quanta={"theta_u": STEP}, source=f"spring-{seed}")


def test_the_spring_is_named_and_measured():
    options = DiagnosisOptions(
        leave_out=tuple(sorted(set(LIBRARY) - KEPT)), most=1, given_rig=True, doubt=0.2
    )
    found = diagnose([recorded(1), recorded(2)], AXIS, [recorded(3)], options=options)
    (effect,) = found.result.effects
    assert effect.id == "upper_spring"
    assert effect.parameters["stiffness"].value == pytest.approx(STIFFNESS, rel=0.05)
    assert effect.parameters["centre"].value == pytest.approx(CENTRE, abs=0.05)
