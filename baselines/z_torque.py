"""Z-torque: impedance matching on the string torque, estimated at the surface.

Dwars, SPE/IADC 173037 (2015).
"""

from __future__ import annotations

import math

import numpy as np

from drill_env._types import FloatArray
from drill_env.environment.config import EnvConfig, View

from ._surface import StringTorque
from .pi import SpeedPI


class ZTorque:
    """Stiff PI whose set point yields to the estimated oscillating string torque over Z.

    Where `ActiveDamping` measures the twist, this one infers the torque from the motor's own
    balance, so that the upper disc ends as a matched impedance: no wave is reflected.

    Args:
        config: environment; its rig is the design model.
        impedance: Z in units of Z0 = sqrt(ktheta Jl).
        corner: of the high-pass, in units of the natural frequency.
        smoothing: time constant of the torque's low-pass, s.
    """

    view: View = "surface"
    history: int = 0

    def __init__(
        self, config: EnvConfig, impedance: float = 2.0, corner: float = 0.2,
        smoothing: float = 0.1,
    ) -> None:  # fmt: skip
        rig = config.rig
        self._pi = SpeedPI(config)
        self._torque = StringTorque(config, smoothing)
        self._impedance = impedance * math.sqrt(rig.ktheta * rig.Jl)
        natural = math.sqrt(rig.ktheta / rig.Jl)
        self._share = 1.0 - math.exp(-corner * natural * config.control_period)
        self._mean = np.zeros(0)
        self._fresh = True

    def reset(self, n: int) -> None:
        """Forget torque, mean and integral."""
        self._pi.reset(n)
        self._torque.reset(n)
        self._mean, self._fresh = np.zeros(n), True

    def act(self, observation: FloatArray) -> FloatArray:
        """Voltage (V) from omega_u, the set point and the last voltage."""
        omega, setpoint, last = observation[:, 0], observation[:, 1], observation[:, 2]
        torque = self._torque.step(omega, last)
        self._mean = torque if self._fresh else self._mean + self._share * (torque - self._mean)
        self._fresh = False
        yielded = setpoint - (torque - self._mean) / self._impedance
        return self._pi.act(np.column_stack([omega, yielded]))
