"""Sliding-mode control of both speeds.

Navarro-Lopez and Cortes, Journal of Sound and Vibration 307 (2007) 152-171.
"""

from __future__ import annotations

import math

import numpy as np

from drill_env._types import FloatArray
from drill_env.environment.config import EnvConfig, View


class SlidingMode:
    """s = (omega_u - W) + rate [integral of (omega_u - W) + integral of (omega_u - omega_l)].

    On s = 0 the table yields to the twist as to the impedance ktheta / rate. The equivalent
    voltage holds s' = 0 on the nominal rig; a boundary layer replaces the sign, as a sampled
    voltage would chatter.

    The rate is wn / `impedance`; in the layer s decays at `reach`, and the switching part is
    `grip` volts deep.

    Args:
        config: environment; its rig is the design model.
        impedance: in units of Z0 = sqrt(ktheta Jl).
        reach: rad/s.
        grip: V.
    """

    view: View = "both"
    history: int = 0

    def __init__(
        self, config: EnvConfig, impedance: float = 2.0, reach: float = 4.0, grip: float = 3.0
    ) -> None:
        rig = self._rig = config.rig
        self.rate = math.sqrt(rig.ktheta / rig.Jl) / impedance
        self.reach = min(reach, 0.5 / config.control_period)
        self.grip = grip
        self._period, self._limit = config.control_period, config.voltage_limit
        self._integral, self._twist = np.zeros(0), np.zeros(0)
        self._fresh = True

    def reset(self, n: int) -> None:
        """Forget the integrals."""
        self._integral, self._twist, self._fresh = np.zeros(n), np.zeros(n), True

    def memory(self) -> FloatArray:
        """Integral and twist (rad) at which the surface began, shape (n, 2)."""
        return np.column_stack([self._integral, self._twist])

    def recall(self, memory: FloatArray) -> None:
        """Continue from an integral and a twist (rad), shape (n, 2)."""
        self._integral, self._twist = np.ascontiguousarray(memory.T)
        self._fresh = False

    def act(self, observation: FloatArray) -> FloatArray:
        """Voltage (V) from the twist, both speeds and the set point."""
        twist, upper, lower, target = observation[:, :4].T
        rig, error = self._rig, upper - target
        if self._fresh:
            # The surface passes through the initial state, so that there is no reaching phase.
            self._twist, self._fresh = twist + error / self.rate, False
        grown = self._integral + self._period * error
        surface = error + self.rate * (grown + twist - self._twist)
        torque = rig.Tsu + rig.dTsu + (rig.bu + rig.dbu) * upper + rig.ktheta * twist
        torque -= rig.Ju * self.rate * (error + upper - lower)
        layer = self.grip * rig.km / (rig.Ju * self.reach)
        wanted = torque / rig.km - self.grip * np.clip(surface / layer, -1.0, 1.0)
        volts = np.clip(wanted, -self._limit, self._limit)
        free = (volts == wanted) | ((wanted > volts) != (error < 0.0))
        self._integral = np.where(free, grown, self._integral)
        return volts
