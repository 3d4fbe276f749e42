"""The bifurcation diagram of a rig with effects."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from drill_env._errors import InputError
from drill_env.continuation._plain import require_string
from drill_env.continuation.equilibria import EquilibriumBranch
from drill_env.continuation.extended_equilibria import (
    extended_hopf_entry,
    extended_hopf_points,
    turning_branch,
)
from drill_env.continuation.extended_flow import ExtendedFlow
from drill_env.continuation.extended_tracer import ExtendedTracer, vibrating
from drill_env.continuation.hopf import HopfPoint
from drill_env.continuation.special import SpecialPoint
from drill_env.continuation.sweep import Progress, swept
from drill_env.continuation.tables import cycle_rows
from drill_env.continuation.tracer import CycleBranch
from drill_env.continuation.tracer import Progress as Traced
from drill_env.effects.steady import acting, lasting, unsteady
from drill_env.parameters import Rig


@dataclass(frozen=True, slots=True, eq=False)
class ExtendedDiagram:
    """Equilibria, limit cycles and attractors of a rig with effects.

    Attributes:
        rig: parameters and effects.
        to_volts: end of the range, V.
        equilibria: turning ones; None where an effect follows time or an angle, or never forgets.
        hopf: Hopf points, by speed.
        attractors: what the rig settles on while the voltage is swept, of `swept`.
        branches: limit cycles, stable and unstable, on branches from Hopf points or attractors.
        points: Hopf points, and the special points of the branches.
        remarks: what was left out, and why.
    """

    rig: Rig
    to_volts: float
    equilibria: EquilibriumBranch | None
    hopf: tuple[HopfPoint, ...]
    attractors: pd.DataFrame
    branches: tuple[CycleBranch, ...]
    points: tuple[SpecialPoint, ...]
    remarks: tuple[str, ...]


def extended_diagram(
    rig: Rig,
    to_volts: float,
    step: float = 0.25,
    progress: Progress | None = None,
    traced: Traced | None = None,
) -> ExtendedDiagram:
    """Equilibria and Hopf points by linearisation, stable motions by a sweep, and their branches.

    Limit cycles are continued from the Hopf points, and from the sweep to both sides, through folds
    into unstable ones. A branch that meets neither, stable nowhere or only within a step of the
    sweep, is not found.

    Args:
        rig: parameters with two inertias, and effects; those of the encoders do not act.
        to_volts: end of the range, V.
        step: of the sweep, V; long steps may leap over an attractor that exists beside another.
        progress: called with simulations done and to do.
        traced: called with the number of limit cycles so far.

    Raises:
        InputError: the rig has one inertia, the range is empty, or an effect is wrong.
        RuntimeError: an integration failed.
    """
    require_string(rig)
    if not (math.isfinite(to_volts) and 0.0 < step < to_volts):
        raise InputError(
            f"to_volts is {to_volts} and step {step}: give a step above 0 V and below the end"
        )
    moving, wandering = acting(rig), unsteady(rig)
    branch, hopf, remarks = None, (), ()
    if wandering:
        remarks = (
            "equilibria and Hopf points are left out: "
            f"{', '.join(wandering)} follow time or an angle, or never forget; so are the cycles' "
            "multipliers and branches",
        )
    else:
        turning = lasting(rig)
        branch = turning_branch(turning, to_volts)
        hopf = tuple(extended_hopf_points(turning, branch, to_volts))
    volts = np.linspace(0.0, to_volts, math.ceil(to_volts / step) + 1)
    attractors = swept(
        moving, np.asarray(volts, dtype=np.float64), progress, multipliers=not wandering
    )
    if not attractors.settled.all():
        where = ", ".join(f"{v:.3g}" for v in sorted(set(attractors.voltage[~attractors.settled])))
        remarks = (*remarks, f"not settled at {where} V: extremes still change there")
    tracer = ExtendedTracer(ExtendedFlow(lasting(rig)), 0.0, to_volts, traced)
    if not wandering:
        tracer.from_hopf_points(hopf)
        _trace(tracer, attractors)
    points = (
        *(extended_hopf_entry(p) for p in hopf),
        *sorted(tracer.points, key=lambda p: p.parameter),
    )
    return ExtendedDiagram(
        rig, to_volts, branch, hopf, attractors, tuple(tracer.branches), points,
        (*remarks, *tracer.failures),
    )  # fmt: skip


def _trace(tracer: ExtendedTracer, attractors: pd.DataFrame) -> None:
    for _, rows in attractors.groupby("direction"):
        way = rows.sort_values("voltage")
        for volts in vibrating(way.voltage.to_numpy(), (way.kind == "cycle").tolist()):
            tracer.through(volts)


def extended_table(diagram: ExtendedDiagram) -> pd.DataFrame:
    """Every equilibrium, attractor and limit cycle, one row each.

    Returns:
        Columns branch (equilibria, up, down, p1, p2, ...), kind (equilibrium, rest, cycle),
        parameter (V), min, max, mean (rad/s), twist (rad), period (s), stuck (share), stable,
        settled, multiplier (size of the largest of a cycle but the one along the flow), character
        (of a continued cycle).
    """
    rows = [*_equilibrium_rows(diagram.equilibria), *_attractor_rows(diagram)]
    return pd.DataFrame([*rows, *_branch_rows(diagram)])


def _equilibrium_rows(branch: EquilibriumBranch | None) -> Iterator[dict[str, Any]]:
    if branch is None:
        return
    columns = (branch.voltage, branch.omega, branch.twist, branch.stable)
    for volts, omega, twist, stable in zip(*(c.tolist() for c in columns), strict=True):
        yield {
            "branch": "equilibria", "kind": "equilibrium", "parameter": volts, "min": omega,
            "max": omega, "mean": omega, "twist": twist, "stable": stable,
        }  # fmt: skip


def _attractor_rows(diagram: ExtendedDiagram) -> Iterator[dict[str, Any]]:
    for row in diagram.attractors.to_dict("records"):
        yield {
            "branch": row["direction"], "kind": row["kind"], "parameter": row["voltage"],
            "min": row["min"], "max": row["max"], "mean": row["mean"], "period": row["period"],
            "stuck": row["stuck"], "stable": True, "settled": row["settled"],
            "multiplier": row["multiplier"],
        }  # fmt: skip


def _branch_rows(diagram: ExtendedDiagram) -> Iterator[dict[str, Any]]:
    kept = ("branch", "kind", "parameter", "min", "max", "period", "stable", "character")
    for row in cycle_rows(diagram.branches):
        stuck = row["sticking_s"] / row["period"]
        yield {key: row[key] for key in kept} | {"stuck": stuck, "multiplier": row["multiplier_1"]}
