"""Active damping: a speed loop that gives way to the torque in the string.

Jansen and van den Steen, Journal of Sound and Vibration 179 (1995) 647-668.
"""

from __future__ import annotations

import math

import numpy as np

from drill_env._types import FloatArray
from drill_env.environment.config import EnvConfig, View

from .pi import SpeedPI


class ActiveDamping:
    """Stiff PI whose set point is lowered by the oscillating string torque over `impedance`.

    The upper disc then behaves as a damper of that impedance: torsional waves that come
    up the string are absorbed. A high-pass keeps the mean speed at the set point.

    Args:
        config: environment; its rig is the design model.
        impedance: in units of Z0 = sqrt(ktheta Jl), the string's own impedance.
        corner: of the high-pass, in units of the string's natural frequency.
    """

    view: View = "both"
    history: int = 0

    def __init__(self, config: EnvConfig, impedance: float = 2.0, corner: float = 0.2) -> None:
        rig = config.rig
        self._pi = SpeedPI(config)
        self._stiffness = rig.ktheta
        self._impedance = impedance * math.sqrt(rig.ktheta * rig.Jl)
        natural = math.sqrt(rig.ktheta / rig.Jl)
        self._share = 1.0 - math.exp(-corner * natural * config.control_period)
        self._mean = np.zeros(0)
        self._fresh = True

    def reset(self, n: int) -> None:
        """Forget the mean torque and the integral."""
        self._pi.reset(n)
        self._mean, self._fresh = np.zeros(n), True

    def memory(self) -> FloatArray:
        """Integral (rad) and mean torque (Nm), shape (n, 2)."""
        return np.column_stack([self._pi.memory(), self._mean])

    def recall(self, memory: FloatArray) -> None:
        """Continue from an integral (rad) and a mean torque (Nm), shape (n, 2)."""
        self._pi.recall(memory[:, :1])
        self._mean, self._fresh = memory[:, 1].copy(), False

    def act(self, observation: FloatArray) -> FloatArray:
        """Voltage (V) from twist, omega_u and the set point."""
        torque = self._stiffness * observation[:, 0]
        self._mean = torque if self._fresh else self._mean + self._share * (torque - self._mean)
        self._fresh = False
        yielded = observation[:, 3] - (torque - self._mean) / self._impedance
        return self._pi.act(np.column_stack([observation[:, 1], yielded]))
