"""Limit cycles and equilibria over any parameter of the rig, at a fixed voltage."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from drill_env._errors import InputError
from drill_env.continuation._plain import require_plain
from drill_env.continuation.cycle import PeriodMap
from drill_env.continuation.equilibria import routh_hurwitz
from drill_env.continuation.special import SpecialPoint
from drill_env.continuation.tracer import CycleBranch, Progress, Tracer
from drill_env.dynamics import equilibrium_speed
from drill_env.friction import lower_curve_slope
from drill_env.parameters import SYMBOLS, Rig


@dataclass(frozen=True, slots=True)
class ParameterDiagram:
    """Branches over one parameter.

    Attributes:
        parameter: symbol of the rig.
        volts: voltage, V.
        equilibria: columns value, omega (rad/s) and stable.
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
        rig: parameters; the one continued is replaced.
        parameter: one of `drill_env.parameters.SYMBOLS`.
        volts: constant voltage, V.
        low: smallest value, in the parameter's unit.
        high: largest value.
        progress: called with the number of cycles so far.

    Raises:
        InputError: the parameter is unknown or the range is empty or unphysical.
    """
    require_plain(rig)
    if parameter not in SYMBOLS:
        raise InputError(f"parameter is {parameter!r}: give one of {', '.join(SYMBOLS)}")
    if not low < high:
        raise InputError(f"range of {parameter} is {low} to {high}: give the smaller value first")
    for value in (low, high):
        rig.replace(**{parameter: value})
    tracer = Tracer(PeriodMap(rig, parameter, volts), low, high, progress=progress)
    tracer.from_simulation()
    points = tuple(sorted(tracer.points, key=lambda p: p.parameter))
    return ParameterDiagram(
        parameter, volts, _equilibria(rig, parameter, volts, np.linspace(low, high, 201)),
        tuple(tracer.branches), points, tuple(tracer.failures),
    )  # fmt: skip


def _equilibria(rig: Rig, parameter: str, volts: float, values: np.ndarray) -> pd.DataFrame:
    rows = []
    for value in values:
        there = rig.replace(**{parameter: float(value)})
        omega = equilibrium_speed(there, volts)
        slope = float(lower_curve_slope(there, omega)) if omega > 0 else 0.0
        stable = omega == 0 or min(routh_hurwitz(there, slope)) > 0.0
        rows.append({"value": float(value), "omega": omega, "stable": stable})
    return pd.DataFrame(rows)
