"""Every effect that moves the rig against an independent solver, through sticks and switches."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.effects_reference.effects import EFFECTS
from benchmarks.effects_reference.settings import MOVING, Problem, entry
from benchmarks.fuzz.draws import draw_moving
from benchmarks.fuzz.truth import USUAL, apart, ours, possible
from drill_env import Rig
from drill_env.integrator import simulate

# Where the usual voltages would never brake.
VOLTS = {"drive_braking_loss": (4.0, -4.0, 2.0)}
# One of every kind: drive, gear, friction, string, brake; with memory, switches and delay.
LONG = (
    "actuator_lag", "slew_limit", "input_delay", "motor_heating", "current_limit",
    "gear_compliance", "gear_backlash", "load_dependent_friction", "upper_viscous",
    "string_hysteresis", "string_creep", "string_inertia", "string_play", "brake_runout",
    "friction_lag", "rate_state", "dwell_stiction", "friction_step", "unbalance", "presliding",
)  # fmt: skip


def gap(names: tuple[str, ...], seconds: float) -> float:
    problem = Problem(names, VOLTS.get(names[0], (2.0, 5.0, 1.5)), seconds)
    ours = problem.ours()
    assert len(ours.events) > 0
    return float(np.abs(ours.state - problem.truth())[:, :3].max())


def test_all_effects_are_compared():
    assert set(MOVING) == set(EFFECTS)


@pytest.mark.parametrize("name", LONG)
def test_a_minute_agrees_to_1e_7(name):
    assert gap((name,), 60.0) < 1e-7


@pytest.mark.parametrize("name", [n for n in MOVING if n not in LONG])
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


# Every law with its clamp, and with discs that stop and turn round.
@pytest.mark.parametrize("number", [6, 8, 11, 24, 39])
def test_random_rigs_of_every_law_agree(number):
    """They do to what the steps' errors can become, which is little where nothing is magnified."""
    case = draw_moving(61, number, 10.0)
    gaps, bound = apart(case, USUAL), possible(case, USUAL)
    assert len(ours(case, USUAL[0]).events) > 2
    assert gaps.max() < 1e-8 and bound.max() < 1e-7
    assert (gaps <= bound + 1e-13).all()


@pytest.mark.parametrize("method", ["dop853", "dopri5"])
def test_tolerances_bound_the_error(method):
    """Both pairs, at the tolerances that a user has without asking and at coarse ones."""
    rig = Rig(effects=(entry("friction_lag"), entry("string_hysteresis")))
    t = np.linspace(0.0, 20.0, 201)
    fine = simulate(rig, 2.0, 20.0, t_eval=t, rtol=1e-13, atol=1e-15)
    for rtol, bound in ((1e-6, 1e-3), (1e-10, 1e-7)):
        run = simulate(rig, 2.0, 20.0, t_eval=t, method=method, rtol=rtol, atol=0.01 * rtol)
        assert np.abs(run.state - fine.state)[:, :3].max() < bound
