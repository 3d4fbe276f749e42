"""SoftSpeed: speed control tuned to absorb torsional waves, from the upper encoder alone.

Kyllingstad and Nessjoen, SPE 119299 (2009), and Kyllingstad, SPE 178835 (2017).
"""

from __future__ import annotations

import math

import numpy as np

from drill_env._types import FloatArray
from drill_env.environment.config import EnvConfig, View

from ._surface import sensor_lag


class SoftSpeed:
    """PI in torque with P near the string's impedance, after the table's own friction.

    Rule: the voltage first cancels Coulomb and viscous friction of the upper disc at the
    measured speed; then P = `impedance` Z0 and I = J wn^2, which cancels the inertia at the
    natural frequency wn. As the cancelled friction lags by the sensor's delay, it leaves
    bu lag behind, which J counts in.

    Args:
        config: environment; its rig is the design model.
        impedance: P in units of Z0 = sqrt(ktheta Jl).
        inertia: I in units of J wn^2.
    """

    view: View = "surface"
    history: int = 0

    def __init__(self, config: EnvConfig, impedance: float = 4.7, inertia: float = 1.0) -> None:
        rig = config.rig
        self.viscous = rig.bu + rig.dbu
        natural = math.sqrt(rig.ktheta / rig.Jl)
        self.p = impedance * math.sqrt(rig.ktheta * rig.Jl)
        lag = sensor_lag(config) + 0.5 * config.control_period
        self.i = inertia * (rig.Ju + self.viscous * lag) * natural**2
        self._gain, self._coulomb = rig.km, rig.Tsu + rig.dTsu
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
        omega, error = observation[:, 0], observation[:, 1] - observation[:, 0]
        grown = self._integral + self._period * error
        torque = self._coulomb + self.viscous * omega + self.p * error + self.i * grown
        wanted = torque / self._gain
        volts = np.clip(wanted, -self._limit, self._limit)
        free = (volts == wanted) | ((wanted > volts) != (error > 0.0))
        self._integral = np.where(free, grown, self._integral)
        return volts
