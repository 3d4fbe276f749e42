"""Steady state: equilibria, limit cycles, their stability and their bifurcations."""

from drill_env.continuation.branch import Corrector, Point, StepRule, follow, oriented
from drill_env.continuation.cycle import CycleError, LimitCycle, PeriodMap
from drill_env.continuation.diagram import Diagram, bifurcation_diagram
from drill_env.continuation.equilibria import (
    EquilibriumBranch,
    StickingSet,
    critical_slope,
    equilibrium_branch,
    jacobian,
    routh_hurwitz,
    sticking_set,
)
from drill_env.continuation.extended_cycle import ExtendedCycle, extended_cycle
from drill_env.continuation.extended_diagram import ExtendedDiagram, extended_diagram
from drill_env.continuation.hopf import HopfPoint, hopf_points
from drill_env.continuation.maps import hopf_map, vibration_map
from drill_env.continuation.parameter import ParameterDiagram, parameter_diagram
from drill_env.continuation.special import SpecialPoint
from drill_env.continuation.tracer import CycleBranch, settled_cycle

__all__ = [
    "Corrector",
    "CycleBranch",
    "CycleError",
    "Diagram",
    "EquilibriumBranch",
    "ExtendedCycle",
    "ExtendedDiagram",
    "HopfPoint",
    "LimitCycle",
    "ParameterDiagram",
    "PeriodMap",
    "Point",
    "SpecialPoint",
    "StepRule",
    "StickingSet",
    "bifurcation_diagram",
    "critical_slope",
    "equilibrium_branch",
    "extended_cycle",
    "extended_diagram",
    "follow",
    "hopf_map",
    "hopf_points",
    "jacobian",
    "oriented",
    "parameter_diagram",
    "routh_hurwitz",
    "settled_cycle",
    "sticking_set",
    "vibration_map",
]
