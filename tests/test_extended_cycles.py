"""Limit cycles and Floquet multipliers of rigs with effects."""

from __future__ import annotations

import numpy as np
import pytest

from drill_env import Rig
from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.continuation import ExtendedCycle, PeriodMap, extended_cycle
from drill_env.integrator import Disc, Kind, simulate

pytestmark = pytest.mark.filterwarnings("ignore::drill_env.integrator.NegativeFrictionWarning")
LAG = {"id": "friction_lag", "time_constant": 0.05}
CREEP = {"id": "string_creep", "compliance": 0.03, "time_constant": 1.0}


def test_an_effect_of_no_size_leaves_the_plain_rigs_cycle() -> None:
    found = extended_cycle(Rig(effects=({"id": "string_damping", "damping": 1e-13},)), 1.2)
    shot = PeriodMap(Rig()).shoot(found.start, found.period, 1.2)
    assert np.abs(shot.end - found.start).max() < 1e-7
    truth = np.linalg.eigvals(shot.jacobian[:, :3])
    truth = np.delete(truth, np.abs(truth - 1.0).argmin())
    assert np.abs(found.multipliers).max() == pytest.approx(np.abs(truth).max(), rel=1e-6)
    assert not found.sticks and found.low > 0.0


def test_a_slow_memory_forgets_at_its_own_rate() -> None:
    """A motor's heat under a constant voltage is an equation of its own: e^(-T/tau)."""
    rig = Rig(effects=({"id": "motor_heating", "loss": 0.05, "time_constant": 10.0},))
    found = extended_cycle(rig, 3.5)
    assert found.stable
    assert found.multipliers[0].real == pytest.approx(np.exp(-found.period / 10.0), rel=1e-7)


def returns(rig: Rig, cycle: ExtendedCycle, y: FloatArray) -> FloatArray:
    """Where a start comes to after a period."""
    run = simulate(
        rig, cycle.voltage, cycle.period, initial=np.append(y[:3], 0.0), inner=y[3:], rtol=1e-12,
        atol=1e-14,
    )  # fmt: skip
    return np.concatenate([run.final_state[:3], run.final_inner])


def test_multipliers_are_those_of_differences_of_the_return() -> None:
    rig = Rig(effects=(LAG, CREEP))
    found = extended_cycle(rig, 3.5)
    columns = []
    for i in range(len(found.start)):
        push = 1e-5 * (np.arange(len(found.start)) == i)
        columns.append(
            (returns(rig, found, found.start + push) - returns(rig, found, found.start - push))
            / 2e-5
        )
    truth = np.sort(np.abs(np.linalg.eigvals(np.column_stack(columns))))[::-1]
    assert truth[0] == pytest.approx(1.0, abs=1e-5)
    assert np.abs(found.multipliers)[:2] == pytest.approx(truth[1:3], abs=1e-6)


def test_a_cycle_that_sticks_forgets_the_lower_disc() -> None:
    found = extended_cycle(Rig(effects=(LAG | {"time_constant": 0.002},)), 2.0)
    run = simulate(Rig(effects=(LAG | {"time_constant": 0.002},)), 2.0, 60.0)
    assert found.sticks and len(run.events.where(Disc.LOWER, Kind.STICK)) > 0
    assert found.misses < 1e-9 and np.abs(found.multipliers[1:]).max() < 1e-6


@pytest.mark.parametrize("effect", [
    {"id": "unbalance", "torque": 0.01, "phase": 0.0},
    {"id": "friction_drift", "drift": 0.05},
    {"id": "string_hysteresis", "torque": 0.01, "width": 0.1},
])  # fmt: skip
def test_what_follows_time_or_an_angle_is_refused_with_the_reason(effect: dict) -> None:
    with pytest.raises(InputError, match="never forget"):
        extended_cycle(Rig(effects=(effect,)), 3.5)


def test_a_rig_that_does_not_vibrate_has_no_cycle() -> None:
    with pytest.raises(InputError, match="turns steadily or rests"):
        extended_cycle(Rig(effects=(LAG,)), 0.2)
