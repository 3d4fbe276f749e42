"""Stiff proportional-integral control of the upper disc's speed."""

from __future__ import annotations

import numpy as np

from drill_env._types import FloatArray
from drill_env.environment.config import EnvConfig, View


class SpeedPI:
    """u = u_c + (kp e + ki integral e), e = setpoint - omega_u, with clamped integral.

    Rule: both poles of the upper disc alone (Ju dw/dt + bu w = km u) at -`pole`, and u_c
    cancels the upper Coulomb torque. The delay of a control period bounds the pole:
    pole * period <= 0.5.

    Args:
        config: environment; its rig is the design model.
        pole: rad/s; 4 makes the table stiff beside the string's 1.55 rad/s.
    """

    view: View = "surface"
    history: int = 0

    def __init__(self, config: EnvConfig, pole: float = 4.0) -> None:
        rig = config.rig
        pole = min(pole, 0.5 / config.control_period)
        self.kp = max(2.0 * pole * rig.Ju - rig.bu, 0.0) / rig.km
        self.ki = pole**2 * rig.Ju / rig.km
        self._offset = (rig.Tsu + rig.dTsu) / rig.km
        self._period, self._limit = config.control_period, config.voltage_limit
        self._integral = np.zeros(0)

    def reset(self, n: int) -> None:
        """Empty the integral."""
        self._integral = np.zeros(n)

    def memory(self) -> FloatArray:
        """The integral (rad), shape (n, 1)."""
        return self._integral[:, None].copy()

    def recall(self, memory: FloatArray) -> None:
        """Continue from an integral (rad), shape (n, 1)."""
        self._integral = memory[:, 0].copy()

    def act(self, observation: FloatArray) -> FloatArray:
        """Voltage (V) from omega_u and the set point."""
        error = observation[:, 1] - observation[:, 0]
        grown = self._integral + self._period * error
        wanted = self._offset + self.kp * error + self.ki * grown
        volts = np.clip(wanted, -self._limit, self._limit)
        # Anti-windup: the integral only grows where that does not deepen saturation.
        free = (volts == wanted) | ((wanted > volts) != (error > 0.0))
        self._integral = np.where(free, grown, self._integral)
        return volts
