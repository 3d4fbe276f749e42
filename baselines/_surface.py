"""What the controllers that see the upper encoder alone share."""

from __future__ import annotations

import math

import numpy as np

from drill_env._types import FloatArray
from drill_env.environment.config import EnvConfig


def sensor_lag(config: EnvConfig) -> float:
    """Delay (s) of the measured speed well below the cutoff: difference and Butterworth filter."""
    encoder = config.encoder
    return 0.5 / encoder.rate_hz + math.sqrt(2.0) / (2.0 * math.pi * encoder.cutoff_hz)


class StringTorque:
    """String torque (Nm) from what the motor gives less what the upper disc takes.

    km u = Ju dw/dt + T_fu + T, with the nominal rig's friction. The voltage is delayed like the
    measured speed, so that both tell of the same moment; a low-pass tames the derivative.

    Args:
        config: environment; its rig is the design model.
        smoothing: time constant of the low-pass, s.
    """

    def __init__(self, config: EnvConfig, smoothing: float) -> None:
        rig, period = config.rig, config.control_period
        self._inertia, self._gain = rig.Ju / period, rig.km
        self._coulomb, self._viscous = rig.Tsu + rig.dTsu, rig.bu + rig.dbu
        self._share = 1.0 - math.exp(-period / max(smoothing, 1e-9))
        # The mean of the period that ends `lag` ago, between whole periods.
        self._late = sensor_lag(config) / period
        self._volts = np.zeros((0, 0))
        self._speed: FloatArray | None = None
        self._torque = np.zeros(0)

    def reset(self, n: int) -> None:
        """Forget everything."""
        self._volts, self._speed = np.zeros((int(self._late) + 2, n)), None
        self._torque = np.zeros(n)

    def step(self, speed: FloatArray, volts: FloatArray) -> FloatArray:
        """Torque (Nm) of about now from the measured speed and the voltage of the last period."""
        if self._speed is None:
            self._volts[:], self._speed = volts, speed.copy()
            self._torque = self._gain * volts - self._coulomb - self._viscous * speed
            return self._torque
        self._volts[1:] = self._volts[:-1]
        self._volts[0] = volts
        whole = int(self._late)
        part = self._late - whole
        given = (1.0 - part) * self._volts[whole] + part * self._volts[whole + 1]
        middle = 0.5 * (speed + self._speed)
        taken = self._inertia * (speed - self._speed) + self._coulomb + self._viscous * middle
        self._speed = speed.copy()
        self._torque = self._torque + self._share * (self._gain * given - taken - self._torque)
        return self._torque
