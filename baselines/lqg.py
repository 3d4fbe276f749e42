"""Linear-quadratic-Gaussian control from the upper encoder alone."""

from __future__ import annotations

import control as ct
import numpy as np

from drill_env.environment.config import EnvConfig, View

from .kalman import filter_gain, integral_feedback, regulator_weight, torque_noise
from .linear import OMEGA_U, Law, ScheduledLaw, noise_levels, sampled_rig, surface_part


class LQG(ScheduledLaw):
    """Kalman filter for twist and both speeds from omega_u, regulator, integral of omega_u.

    Args:
        config: environment; its rig is the design model.
        effort: weight of volts^2.
        slip: weight of (omega_u - omega_l)^2.
        upper: unmodelled change of omega_u in a period, rad/s.
        lower: likewise of omega_l.
        integral: weight of the squared integral of the omega_u error.
        relax: rate at which the integral gives way per volt that is clipped, rad/s per V.
    """

    view: View = "surface"

    def __init__(
        self, config: EnvConfig, effort: float = 1.0, slip: float = 1.0, upper: float = 0.003,
        lower: float = 0.03, integral: float = 0.01, relax: float = 1.0,
    ) -> None:  # fmt: skip
        super().__init__(config)
        self.effort, self.slip, self.integral = effort, slip, integral
        self.upper, self.lower, self.relax = upper, lower, relax

    def law(self, setpoint: float) -> Law:
        """The law at a set point (rad/s)."""
        system = surface_part(sampled_rig(self.config, setpoint))
        noise = noise_levels(self.config)[1:2]
        gain = filter_gain(system, torque_noise(system, self.upper, self.lower), noise)
        n = len(system.A)
        a, b, q = np.eye(n + 1), np.append(system.B[:, 0], 0.0), np.zeros((n + 1, n + 1))
        a[:n, :n], a[n, OMEGA_U] = system.A, float(system.dt)
        q[:n, :n], q[n, n] = regulator_weight(n, self.slip), self.integral
        feedback = np.asarray(ct.dlqr(a, b[:, None], q, [[self.effort]])[0])[0]
        relax = self.relax * float(system.dt)
        return integral_feedback(system, gain, feedback[:n], feedback[n], 0, relax)
