"""Equations of motion and equilibria."""

from drill_env.dynamics.equilibrium import (
    equilibrium_speed,
    equilibrium_state,
    equilibrium_voltage,
)

__all__ = ["equilibrium_speed", "equilibrium_state", "equilibrium_voltage"]
