"""Controllers measured against each other and against the open loop."""

from drill_env.benchmark.compare import (
    SETPOINTS,
    STARTS,
    UnreachableWarning,
    compare,
    run_closed_loop,
)
from drill_env.benchmark.measures import Measures, measure, vibration_free
from drill_env.benchmark.open_loop_diagram import open_loop_diagram

__all__ = [
    "SETPOINTS",
    "STARTS",
    "Measures",
    "UnreachableWarning",
    "compare",
    "measure",
    "open_loop_diagram",
    "run_closed_loop",
    "vibration_free",
]
