"""Limit cycles and equilibria over any parameter of the rig, at a fixed voltage."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.continuation._numbers import with_number
from drill_env.continuation._plain import returning
from drill_env.continuation.cycle import PeriodMap
from drill_env.continuation.equilibria import routh_hurwitz
from drill_env.continuation.extended_equilibria import turning_at
from drill_env.continuation.extended_flow import ExtendedFlow
from drill_env.continuation.extended_tracer import ExtendedTracer
from drill_env.continuation.special import SpecialPoint
from drill_env.continuation.tracer import CycleBranch, Progress, Tracer
from drill_env.dynamics import equilibrium_speed
from drill_env.friction import lower_curve_slope
from drill_env.parameters import Rig

# Each of a rig with effects is a search of its own.
_EQUILIBRIA, _FEWER = 201, 21


@dataclass(frozen=True, slots=True)
class ParameterDiagram:
    """Branches over one parameter.

    Attributes:
        parameter: symbol of the rig.
        volts: voltage, V.
        equilibria: columns value, omega (rad/s) and stable; of a rig with effects those that turn.
        branches: limit cycles.
        points: special points, by value.
        failures: steps that failed, and why.
    """

    parameter: str
    volts: float
    equilibria: pd.DataFrame
    branches: tuple[CycleBranch, ...]
    points: tuple[SpecialPoint, ...]
    failures: tuple[str, ...]


def parameter_diagram(
    rig: Rig,
    parameter: str,
    volts: float,
    low: float,
    high: float,
    progress: Progress | None = None,
) -> ParameterDiagram:
    """Continue cycles in `parameter` between `low` and `high` at `volts`.

    Cycles start from what the rig settles on at six values inside the range.

    Args:
        rig: parameters and effects, none of which follows time or an angle or never forgets; the
            number continued is replaced.
        parameter: a symbol of the rig, or a number of an effect as ``string_damping.damping``.
        volts: constant voltage, V.
        low: smallest value, in the parameter's unit.
        high: largest value.
        progress: called with the number of cycles so far.

    Raises:
        InputError: the parameter is unknown, the range is empty or unphysical, or with an effect
            no motion comes back.
    """
    turning = returning(rig)
    if not low < high:
        raise InputError(f"range of {parameter} is {low} to {high}: give the smaller value first")
    for value in (low, high):
        with_number(turning, parameter, value)
    tracer: Tracer | ExtendedTracer
    if turning.effects:
        flow = ExtendedFlow(turning, parameter, volts)
        tracer, count = ExtendedTracer(flow, low, high, progress), _FEWER
    else:
        flow = PeriodMap(turning, parameter, volts)
        tracer, count = Tracer(flow, low, high, progress=progress), _EQUILIBRIA
    tracer.from_simulation()
    points = tuple(sorted(tracer.points, key=lambda p: p.parameter))
    return ParameterDiagram(
        parameter, volts, _equilibria(turning, parameter, volts, np.linspace(low, high, count)),
        tuple(tracer.branches), points, tuple(tracer.failures),
    )  # fmt: skip


def _equilibria(rig: Rig, parameter: str, volts: float, values: FloatArray) -> pd.DataFrame:
    rows = []
    for value in values.tolist():
        there = with_number(rig, parameter, value)
        turning = _turning_with_effects if rig.effects else _turning
        rows += [{"value": value, "omega": w, "stable": ok} for w, ok in turning(there, volts)]
    return pd.DataFrame(rows, columns=["value", "omega", "stable"])


def _turning(rig: Rig, volts: float) -> list[tuple[float, bool]]:
    omega = equilibrium_speed(rig, volts)
    slope = float(lower_curve_slope(rig, omega)) if omega > 0 else 0.0
    return [(omega, omega == 0 or min(routh_hurwitz(rig, slope)) > 0.0)]


def _turning_with_effects(rig: Rig, volts: float) -> list[tuple[float, bool]]:
    return [(float(state[2]), stable) for state, stable in turning_at(rig, volts)]
