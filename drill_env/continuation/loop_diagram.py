"""The bifurcation diagram of a controlled rig over the set point."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from drill_env._errors import InputError
from drill_env.continuation.branch import StepRule
from drill_env.continuation.loop_equilibria import EquilibriumTracer
from drill_env.continuation.loop_period import SampledLoop
from drill_env.continuation.loop_tracer import LoopTracer
from drill_env.continuation.special import SpecialPoint
from drill_env.continuation.tracer import CycleBranch, Progress
from drill_env.controllers import Controller
from drill_env.environment.config import EnvConfig
from drill_env.environment.targets import check_setpoint

_RULE = StepRule(largest=0.2)


@dataclass(frozen=True, slots=True)
class LoopDiagram:
    """Steady motions of a controlled rig.

    Attributes:
        loop: the sampled loop.
        low: smallest set point, rad/s.
        high: largest set point, rad/s.
        equilibria: their branch; `LoopMotion` at every point.
        branches: limit cycles, stable and unstable.
        points: special points, by set point.
        failures: steps that failed, and why.
    """

    loop: SampledLoop
    low: float
    high: float
    equilibria: CycleBranch
    branches: tuple[CycleBranch, ...]
    points: tuple[SpecialPoint, ...]
    failures: tuple[str, ...]


def loop_diagram(
    controller: Controller,
    config: EnvConfig,
    low: float,
    high: float,
    *,
    filtered: bool = True,
    starts: int = 5,
    rule: StepRule | None = None,
    progress: Progress | None = None,
) -> LoopDiagram:
    """Continue equilibria and limit cycles of the sampled loop over the set point.

    Args:
        controller: designed from `config`; see `drill_env.controllers.Remembering`.
        config: rig, control period, encoder rate and filter, voltage limit.
        low: smallest set point, rad/s.
        high: largest set point, rad/s.
        filtered: velocities come from the configured filter; else they are exact.
        starts: set points at which the loop settles, in search of further cycles.
        rule: step lengths along the branches.
        progress: called with the number of cycles so far.

    Raises:
        InputError: the range is empty, or the controller's memory cannot be read.
    """
    if not check_setpoint(low) < check_setpoint(high):
        raise InputError(f"set points from {low} to {high}: give the smaller one first")
    loop, rule = SampledLoop(controller, config, filtered), rule or _RULE
    rests = EquilibriumTracer(loop, low, high, rule)
    equilibria = rests.branch()
    cycles = LoopTracer(loop, low, high, rule, progress)
    cycles.from_births([point for point in rests.points if point.kind == "neimark-sacker"])
    cycles.from_simulation(starts)
    points = [_with_criticality(point, cycles.branches) for point in rests.points]
    points = sorted([*points, *cycles.points], key=lambda point: point.parameter)
    failures = (*rests.failures, *cycles.failures)
    return LoopDiagram(loop, low, high, equilibria, tuple(cycles.branches), tuple(points), failures)


def _with_criticality(point: SpecialPoint, branches: list[CycleBranch]) -> SpecialPoint:
    """What kind of cycles is born at a Neimark-Sacker point, from the branch that begins there."""
    if point.kind != "neimark-sacker" or not branches:
        return point
    ends = [end for branch in branches for end in (branch.points[0], branch.points[-1])]
    near = min(ends, key=lambda end: abs(end.cycle.parameter - point.parameter)).cycle
    # A cycle that small belongs to the equilibrium beside it.
    if near.max - near.min > 0.2 * abs(point.omega):
        return point
    kind = "stable cycles: supercritical" if near.stable else "unstable cycles: subcritical"
    return dataclasses.replace(point, remark=kind)
