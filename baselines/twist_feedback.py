"""Twist feedback: the voltage falls with the measured twist, over a slow speed integral."""

from __future__ import annotations

import math

import numpy as np

from drill_env._types import FloatArray
from drill_env.dynamics import equilibrium_voltage
from drill_env.environment.config import EnvConfig, View


class TwistFeedback:
    """u = u_eq - k (twist - its mean) + slow integral of the omega_u error.

    Rule: well below the corner (bu/Ju = 4 rad/s) the upper disc follows the voltage, so
    k = ktheta bu / (km Z) makes it yield like the impedance Z.

    Args:
        config: environment; its rig is the design model.
        impedance: Z in units of Z0 = sqrt(ktheta Jl).
        corner: of the twist's high-pass and of the integral, in units of the natural frequency.
    """

    view: View = "both"
    history: int = 0

    def __init__(self, config: EnvConfig, impedance: float = 2.0, corner: float = 0.2) -> None:
        rig = self._rig = config.rig
        viscous = rig.bu + rig.dbu
        string = math.sqrt(rig.ktheta * rig.Jl)
        self.k = rig.ktheta * viscous / (rig.km * impedance * string)
        slow = corner * math.sqrt(rig.ktheta / rig.Jl)
        self.ki = slow * viscous / rig.km
        self._share = 1.0 - math.exp(-slow * config.control_period)
        self._period, self._limit = config.control_period, config.voltage_limit
        self._integral, self._mean, self._fresh = np.zeros(0), np.zeros(0), True

    def reset(self, n: int) -> None:
        """Forget the mean twist and the integral."""
        self._integral, self._mean, self._fresh = np.zeros(n), np.zeros(n), True

    def memory(self) -> FloatArray:
        """Integral and mean twist (rad), shape (n, 2)."""
        return np.column_stack([self._integral, self._mean])

    def recall(self, memory: FloatArray) -> None:
        """Continue from an integral and a mean twist (rad), shape (n, 2)."""
        self._integral, self._mean = np.ascontiguousarray(memory.T)
        self._fresh = False

    def act(self, observation: FloatArray) -> FloatArray:
        """Voltage (V) from twist, omega_u and the set point."""
        twist, error = observation[:, 0], observation[:, 3] - observation[:, 1]
        self._mean = twist if self._fresh else self._mean + self._share * (twist - self._mean)
        self._fresh = False
        grown = self._integral + self._period * error
        wanted = equilibrium_voltage(self._rig, observation[:, 3]) + self.ki * grown
        wanted -= self.k * (twist - self._mean)
        volts = np.clip(wanted, -self._limit, self._limit)
        free = (volts == wanted) | ((wanted > volts) != (error > 0.0))
        self._integral = np.where(free, grown, self._integral)
        return volts
