"""Event-driven integration of the set-valued rig."""

from drill_env.integrator.batch import simulate_batch
from drill_env.integrator.simulate import REST, NegativeFrictionWarning, simulate
from drill_env.integrator.steady import first_inner, vector_field
from drill_env.integrator.trajectory import Disc, Events, Kind, Trajectory
from drill_env.integrator.voltage import (
    Voltage,
    as_voltage,
    constant_voltage,
    function_voltage,
    sampled_voltage,
)

__all__ = [
    "REST", "Disc", "Events", "Kind", "NegativeFrictionWarning", "Trajectory", "Voltage",
    "as_voltage", "constant_voltage", "first_inner", "function_voltage", "sampled_voltage",
    "simulate", "simulate_batch", "vector_field",
]  # fmt: skip
