"""Branches of limit cycles of rigs with effects: folds, grazes and reversals."""

from __future__ import annotations

import numpy as np
import pytest

from drill_env import Rig
from drill_env.continuation import bifurcation_diagram
from drill_env.continuation.extended_flow import ExtendedFlow
from drill_env.continuation.extended_tracer import ExtendedTracer, vibrating
from drill_env.continuation.special import SpecialPoint
from drill_env.integrator import Disc, Kind, simulate

pytestmark = pytest.mark.filterwarnings("ignore::drill_env.integrator.NegativeFrictionWarning")


def traced(effect: dict, low: float, high: float, start: float) -> ExtendedTracer:
    found = ExtendedTracer(ExtendedFlow(Rig(effects=(effect,))), low, high)
    found.through(start)
    assert found.failures == []
    return found


def only(points: list[SpecialPoint], kind: str) -> SpecialPoint:
    (point,) = [point for point in points if point.kind == kind]
    return point


def test_an_effect_that_is_a_parameter_has_the_branch_of_that_parameter() -> None:
    """More viscous friction of the motor, as an effect and in the rig's own damping.

    The plain rig's continuation shares neither the integrator's effects nor their derivatives.
    """
    found = traced({"id": "upper_viscous", "damping": 0.2}, 0.0, 3.0, 2.5)
    plain = bifurcation_diagram(Rig().replace(bu=Rig().bu + 0.2), 3.0)
    kinds = {"grazing", "reversal", "last stick"}
    truth = sorted((p.parameter, p.kind) for p in plain.points if p.kind in kinds)
    ours = sorted((p.parameter, p.kind) for p in found.points)
    assert [kind for _, kind in ours] == [kind for _, kind in truth]
    np.testing.assert_allclose([v for v, _ in ours], [v for v, _ in truth], atol=1e-7)
    assert len(ours) == 3
    ends = {" ".join(branch.end.split()[:2]) for branch in found.branches}
    assert ends == {"left the", "shrank to"}


def test_a_fold_and_a_graze_with_a_memory_are_what_simulation_does() -> None:
    rig = Rig(effects=({"id": "friction_lag", "time_constant": 0.02},))
    found = traced(dict(rig.effects[0]), 13.5, 15.0, 13.9)
    fold = only(found.points, "fold")
    assert np.abs(fold.multipliers).max() == pytest.approx(1.0, abs=1e-5)
    branch = next(b for b in found.branches if any(not p.cycle.stable for p in b.points))
    stable = [p.cycle.parameter for p in branch.points if p.cycle.stable]
    assert max(stable) == pytest.approx(fold.parameter, abs=1e-3)

    def vibrates(volts: float) -> bool:
        cycle = branch.points[0].cycle
        start = np.append(cycle.state[:3], 0.0)
        run = simulate(rig, volts, 500.0, initial=start, inner=cycle.state[3:], rtol=1e-8)
        return bool(np.ptp(run.omega_l[-800:]) > 5.0)

    assert vibrates(fold.parameter - 0.01) and not vibrates(fold.parameter + 0.2)
    graze = only(found.points, "grazing")
    assert graze.cycle is not None
    for volts, touches in ((graze.parameter + 1e-4, False), (graze.parameter - 1e-4, True)):
        run = simulate(
            rig, volts, 200.0, initial=np.append(graze.cycle.state[:3], 0.0),
            inner=graze.cycle.state[3:], rtol=1e-10, extrema=True,
        )  # fmt: skip
        late = run.events.where(Disc.LOWER)
        kinds = late.kind[late.t > 150.0]
        assert np.isin(kinds, (Kind.STICK, Kind.REVERSAL)).any() == touches


def test_the_shot_is_differentiated_as_differences_say() -> None:
    flow = ExtendedFlow(Rig(effects=({"id": "supply_sag", "sag": 0.02},)))
    state, period, volts = np.array([5.0, 12.0, 17.0]), 4.0, 6.0
    shot, step = flow.shoot(state, period, volts), 1e-5
    ahead, back = (flow.shoot(state, period, volts + h).end for h in (step, -step))
    np.testing.assert_allclose(shot.jacobian[:, -1], (ahead - back) / (2 * step), rtol=1e-4)
    ahead, back = (flow.shoot(state, period + h, volts).end for h in (step, -step))
    np.testing.assert_allclose(shot.jacobian[:, -2], (ahead - back) / (2 * step), rtol=1e-5)


def test_each_stretch_of_vibration_is_begun_in_its_middle() -> None:
    volts = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
    assert list(vibrating(volts, [False, True, True, True, False, True])) == [2.0, 5.0]
