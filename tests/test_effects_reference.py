"""Every effect that moves the rig against an independent solver, through sticks and switches."""

from __future__ import annotations

import numpy as np
import pytest

from drill_env import Rig
from drill_env.effects import LIBRARY
from drill_env.integrator import sampled_voltage, simulate
from tests.reference_effects import reference
from tests.reference_effects_list import EFFECTS

# Where the middle of the grid would do nothing in the run.
SETTINGS = {
    "wear": {"distance": 100.0},
    "amplifier_saturation": {"level": 3.0},
    "current_limit": {"level": 3.0, "back_emf": 0.3},
    "friction_step": {"time": 4.0},
    "torque_pulse": {"time": 4.0},
    "amplifier_deadzone": {"width": 0.2},
    "upper_presliding": {"distance": 0.05},
    "presliding": {"distance": 0.15},
}
# Where the usual voltages would never brake.
VOLTS = {"drive_braking_loss": (4.0, -4.0, 2.0)}
# One of every kind: drive, gear, friction, string, brake; with memory, switches and delay.
LONG = (
    "actuator_lag", "slew_limit", "input_delay", "motor_heating", "current_limit",
    "gear_compliance", "gear_backlash", "load_dependent_friction", "upper_viscous",
    "string_hysteresis", "string_creep", "string_inertia", "string_play", "brake_runout",
    "friction_lag", "rate_state", "dwell_stiction", "friction_step", "unbalance", "presliding",
)  # fmt: skip


def entry(name: str) -> dict[str, object]:
    middle = {p.name: p.grid[len(p.grid) // 2] for p in LIBRARY[name].parameters}
    return {"id": name, **middle, **SETTINGS.get(name, {})}


def gap(names: tuple[str, ...], seconds: float, rtol: float = 1e-12) -> float:
    volts = VOLTS.get(names[0], (2.0, 5.0, 1.5))
    steps = list(zip((0.0, seconds / 3, 2 * seconds / 3), volts, strict=True))
    t = np.linspace(0.0, seconds, 601)
    effects = [entry(name) for name in names]
    drive = sampled_voltage(np.array([s[0] for s in steps]), np.array(volts), seconds)
    rig = Rig(effects=tuple(effects))
    ours = simulate(rig, drive, seconds, t_eval=t, rtol=rtol, atol=0.01 * rtol)
    assert len(ours.events) > 0
    truth = reference(Rig(), effects, steps, seconds, t)
    return float(np.abs(ours.state - truth)[:, :3].max())


def test_nearly_all_effects_are_compared():
    moving = {name for name, effect in LIBRARY.items() if not effect.senses}
    assert moving - set(EFFECTS) == {"upper_friction_lag"}


@pytest.mark.parametrize("name", LONG)
def test_a_minute_agrees_to_1e_7(name):
    assert gap((name,), 60.0) < 1e-7


@pytest.mark.parametrize(
    "name", [n for n, e in LIBRARY.items() if not e.senses and n in EFFECTS and n not in LONG]
)
def test_twenty_seconds_agree(name):
    assert gap((name,), 20.0) < 1e-8


@pytest.mark.parametrize("names", [
    ("friction_lag", "string_hysteresis", "actuator_lag"),
    ("gear_compliance", "brake_runout", "string_damping"),
    ("slew_limit", "string_play", "lower_stribeck", "unbalance"),
    ("motor_heating", "friction_heating", "string_creep", "rate_state"),
])  # fmt: skip
def test_several_at_once_agree(names):
    assert gap(names, 30.0) < 1e-7


@pytest.mark.parametrize("method", ["dop853", "dopri5"])
def test_tolerances_bound_the_error(method):
    """Both pairs, at the tolerances that a user has without asking and at coarse ones."""
    rig = Rig(effects=(entry("friction_lag"), entry("string_hysteresis")))
    t = np.linspace(0.0, 20.0, 201)
    fine = simulate(rig, 2.0, 20.0, t_eval=t, rtol=1e-13, atol=1e-15)
    for rtol, bound in ((1e-6, 1e-3), (1e-10, 1e-7)):
        run = simulate(rig, 2.0, 20.0, t_eval=t, method=method, rtol=rtol, atol=0.01 * rtol)
        assert np.abs(run.state - fine.state)[:, :3].max() < bound
