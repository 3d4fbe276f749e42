"""Linear-quadratic regulators over a Kalman filter, both encoders, without and with integral."""

from __future__ import annotations

import control as ct
import numpy as np

from drill_env._types import FloatArray
from drill_env.environment.config import EnvConfig

from .kalman import (
    estimated_feedback,
    filter_gain,
    integral_feedback,
    regulator_weight,
    torque_noise,
)
from .linear import OMEGA_L, Law, ScheduledLaw, noise_levels, sampled_rig


class LQR(ScheduledLaw):
    """Minimises (omega_l error)^2 + (omega_u - omega_l)^2 + `effort` volts^2.

    Args:
        config: environment; its rig is the design model.
        effort: weight of volts^2.
        slip: weight of (omega_u - omega_l)^2.
        upper: unmodelled change of omega_u in a period, rad/s.
        lower: likewise of omega_l: friction of another size and stick.
    """

    def __init__(
        self, config: EnvConfig, effort: float = 1.0, slip: float = 1.0, upper: float = 0.05,
        lower: float = 0.1,
    ) -> None:  # fmt: skip
        super().__init__(config)
        self.effort, self.slip, self.upper, self.lower = effort, slip, upper, lower

    def _parts(self, setpoint: float) -> tuple[ct.StateSpace, FloatArray, FloatArray]:
        system = sampled_rig(self.config, setpoint)
        gain = filter_gain(
            system, torque_noise(system, self.upper, self.lower), noise_levels(self.config)
        )
        return system, gain, regulator_weight(len(system.A), self.slip)

    def law(self, setpoint: float) -> Law:
        """The law at a set point (rad/s)."""
        system, gain, weight = self._parts(setpoint)
        feedback, _, _ = ct.dlqr(system.A, system.B, weight, [[self.effort]])
        return estimated_feedback(system, gain, np.asarray(feedback)[0])


class LQI(LQR):
    """`LQR` with the integral of the omega_l error, which takes the bias away.

    Args:
        config: environment.
        effort: weight of volts^2.
        integral: weight of the squared integral.
        relax: rate at which the integral gives way per volt that is clipped, rad/s per V.
        **options: of `LQR`.
    """

    def __init__(
        self, config: EnvConfig, effort: float = 1.0, integral: float = 0.1, relax: float = 1.0,
        **options: float,
    ) -> None:  # fmt: skip
        super().__init__(config, effort, **options)
        self.integral, self.relax = integral, relax

    def augmented(self, setpoint: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Sampled rig with the integral as its last state: A, B and the weight of the state."""
        system, _, weight = self._parts(setpoint)
        n = len(system.A)
        a, b, q = np.eye(n + 1), np.append(system.B[:, 0], 0.0), np.zeros((n + 1, n + 1))
        a[:n, :n], a[n, OMEGA_L] = system.A, float(system.dt)
        q[:n, :n], q[n, n] = weight, self.integral
        return a, b, q

    def law(self, setpoint: float) -> Law:
        """The law at a set point (rad/s)."""
        system, gain, _ = self._parts(setpoint)
        a, b, weight = self.augmented(setpoint)
        feedback = np.asarray(ct.dlqr(a, b[:, None], weight, [[self.effort]])[0])[0]
        relax = self.relax * float(system.dt)
        return integral_feedback(system, gain, feedback[:-1], feedback[-1], OMEGA_L, relax)
