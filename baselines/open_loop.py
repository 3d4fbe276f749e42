"""Constant voltage: the open-loop behaviour every controller is held against."""

from __future__ import annotations

from drill_env._types import FloatArray
from drill_env.dynamics import equilibrium_voltage
from drill_env.environment.config import EnvConfig, View


class OpenLoop:
    """The voltage whose equilibrium is the set point on the nominal rig, equation (11)."""

    view: View = "surface"
    history: int = 0

    def __init__(self, config: EnvConfig) -> None:
        self._rig = config.rig

    def reset(self, n: int) -> None:
        """Nothing to forget."""

    def act(self, observation: FloatArray) -> FloatArray:
        """Voltage (V) from the set point alone."""
        return equilibrium_voltage(self._rig, observation[:, 1])
