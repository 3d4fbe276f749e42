"""The bifurcation diagram: every branch and every special point of one rig."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

import numpy as np

from drill_env._errors import InputError
from drill_env.continuation._plain import returning
from drill_env.continuation.branch import StepRule
from drill_env.continuation.cycle import PeriodMap
from drill_env.continuation.equilibria import EquilibriumBranch, equilibrium_branch, speed_at
from drill_env.continuation.extended_equilibria import (
    extended_hopf_entry,
    extended_hopf_points,
    turning_branch,
)
from drill_env.continuation.extended_flow import ExtendedFlow
from drill_env.continuation.extended_tracer import ExtendedTracer
from drill_env.continuation.hopf import HopfPoint, hopf_points
from drill_env.continuation.special import SpecialPoint
from drill_env.continuation.tracer import CycleBranch, Progress, Tracer
from drill_env.parameters import Rig

_EQUILIBRIA = 600


@dataclass(frozen=True, slots=True)
class Diagram:
    """Everything of Fig. 4 for one rig.

    Attributes:
        rig: parameters, and those of its effects that act under a constant voltage.
        to_volts: end of the range, V.
        equilibria: the turning branch (11).
        hopf: Hopf points, by speed.
        branches: limit cycles.
        points: special points, by voltage.
        failures: steps that failed, and why.
    """

    rig: Rig
    to_volts: float
    equilibria: EquilibriumBranch
    hopf: tuple[HopfPoint, ...]
    branches: tuple[CycleBranch, ...]
    points: tuple[SpecialPoint, ...]
    failures: tuple[str, ...] = field(default=())


def bifurcation_diagram(
    rig: Rig, to_volts: float, rule: StepRule | None = None, progress: Progress | None = None
) -> Diagram:
    """Equilibria, Hopf points, limit cycles and special points up to `to_volts`.

    Branches of cycles are searched for from the Hopf points, and from what the rig settles on from
    rest at six voltages of the range.

    Args:
        rig: parameters with two inertias, and effects; those of the encoders do not act.
        to_volts: end of the range, V, above the break-away voltage of the rig without effects.
        rule: step lengths along the cycles.
        progress: called with the number of cycles so far.

    Raises:
        InputError: the rig has one inertia, an effect follows time or an angle or never forgets,
            or the range ends below break-away.
    """
    turning = returning(rig)
    if not to_volts > rig.breakaway_voltage:
        raise InputError(
            f"to_volts is {to_volts}: give more than the break-away voltage, "
            f"{rig.breakaway_voltage:.4g} V"
        )
    if turning.effects:
        return _with_effects(turning, to_volts, rule, progress)
    return _without(turning, to_volts, rule, progress)


def _without(
    rig: Rig, to_volts: float, rule: StepRule | None, progress: Progress | None
) -> Diagram:
    top = speed_at(rig, to_volts)
    grid = np.unique(
        np.concatenate([np.geomspace(1e-3, top, 150), np.linspace(1e-3, top, _EQUILIBRIA)])
    )
    branch = equilibrium_branch(rig, grid)
    hopf = tuple(hopf_points(rig, to_volts))
    tracer = Tracer(PeriodMap(rig), rig.breakaway_voltage, to_volts, hopf, rule, progress)
    tracer.from_hopf_points()
    tracer.from_simulation()
    points = sorted(
        [_break_away(rig), *(_hopf_entry(h) for h in hopf), *tracer.points],
        key=lambda p: p.parameter,
    )
    return Diagram(
        rig, to_volts, branch, hopf, tuple(tracer.branches), tuple(_named(points)),
        tuple(tracer.failures),
    )  # fmt: skip


def _with_effects(
    rig: Rig, to_volts: float, rule: StepRule | None, progress: Progress | None
) -> Diagram:
    branch = turning_branch(rig, to_volts)
    hopf = tuple(extended_hopf_points(rig, branch, to_volts))
    tracer = ExtendedTracer(ExtendedFlow(rig), 0.0, to_volts, progress)
    tracer.rule = rule or tracer.rule
    tracer.from_hopf_points(hopf)
    tracer.from_simulation()
    points = sorted(
        [*(extended_hopf_entry(h) for h in hopf), *tracer.points], key=lambda p: p.parameter
    )
    return Diagram(
        rig, to_volts, branch, hopf, tuple(tracer.branches), tuple(points), tuple(tracer.failures)
    )


def _break_away(rig: Rig) -> SpecialPoint:
    return SpecialPoint(
        "", "break-away", rig.breakaway_voltage, 0.0, 0.0, 0.0, float("nan"), (),
        "u_c1 = (Tsu + dTsu + Tsl) / km, closed form", 0.0,
        "the sticking set e1 merges into the turning branch",
    )  # fmt: skip


def _hopf_entry(point: HopfPoint) -> SpecialPoint:
    kind = "supercritical" if point.supercritical else "subcritical"
    return SpecialPoint(
        "", "hopf", point.voltage, point.omega, point.omega, point.omega,
        2.0 * np.pi / point.frequency, (), "T_l' equals the critical slope of Routh and Hurwitz",
        1e-12, f"{kind}: first Lyapunov coefficient {point.lyapunov:.6g}",
    )  # fmt: skip


def _named(points: list[SpecialPoint]) -> list[SpecialPoint]:
    """The paper's letters where the diagram has the paper's shape."""
    hopf = [p for p in points if p.kind == "hopf"]
    folds = [p for p in points if p.kind == "fold"]
    letters: dict[int, str] = {}
    if len(hopf) == 2 and len(folds) == 1:
        first, second = sorted(hopf, key=lambda p: p.omega)
        letters = {id(first): "B", id(second): "D", id(folds[0]): "C"}
    out = []
    for point in points:
        name = "A" if point.kind == "break-away" else letters.get(id(point), "")
        out.append(dataclasses.replace(point, name=name))
    return out
