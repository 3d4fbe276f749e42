"""H-infinity mixed sensitivity on the lower disc's speed, both encoders."""

from __future__ import annotations

import control as ct
import numpy as np
from scipy.linalg import matrix_balance, solve_discrete_are

from drill_env.environment.config import EnvConfig

from ._surface import sensor_lag
from .linear import OMEGA_L, Law, ScheduledLaw, rig_matrices


class HInfinity(ScheduledLaw):
    """Minimises the peak from (voltage disturbance, noise) to (weighted error, weighted voltage).

    The four blocks are S, KS and both once more behind the rig: without the disturbance at
    the rig's input the optimum would mirror the rig's poorly damped poles and leave them there.
    The error's weight (s/2 + bandwidth) / (s + bandwidth/1000) asks for no bias. The delay of
    filter and holds is a first-order Pade term of the model. The law is then sampled with a
    hold, and kept from winding up at the limit by its own observer form.

    Args:
        config: environment; its rig is the design model.
        bandwidth: rad/s.
        effort: weight of volts.
        push: size of the voltage disturbance, V.
        noise: of the measured omega_l, rad/s.
    """

    def __init__(
        self, config: EnvConfig, bandwidth: float = 0.5, effort: float = 1.0, push: float = 1.0,
        noise: float = 0.3,
    ) -> None:  # fmt: skip
        super().__init__(config)
        self.bandwidth, self.effort, self.push, self.noise = bandwidth, effort, push, noise

    def model(self, setpoint: float) -> ct.StateSpace:
        """Continuous design model from volts to measured omega_l."""
        a, b = rig_matrices(self.config.rig, setpoint)
        rig = ct.StateSpace(a, b[:, None], np.eye(3)[[OMEGA_L]], [[0.0]])
        late = sensor_lag(self.config) + self.config.control_period
        return ct.ss(ct.tf(*ct.pade(late, 1))) * rig

    def generalised(self, setpoint: float) -> ct.StateSpace:
        """From (disturbance, noise, volts) to (error, volts, measured shortfall), weighted."""
        model = self.model(setpoint)
        n, pole = len(model.A), 1e-3 * self.bandwidth
        a, b, c = np.zeros((n + 1, n + 1)), np.zeros((n + 1, 3)), np.zeros((3, n + 1))
        a[:n, :n], a[n, :n] = model.A, -(self.bandwidth - 0.5 * pole) * model.C[0]
        a[n, n] = -pole
        b[:n, 0], b[:n, 2] = self.push * model.B[:, 0], model.B[:, 0]
        c[0, :n], c[0, n], c[2, :n] = -0.5 * model.C[0], 1.0, -model.C[0]
        d = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, self.effort], [0.0, -self.noise, 0.0]])
        return ct.StateSpace(a, b, c, d)

    def continuous(self, setpoint: float) -> tuple[ct.StateSpace, float]:
        """Controller from omega_l's shortfall to volts, and the peak it reaches."""
        law, _, peak, _ = ct.hinfsyn(self.generalised(setpoint), 1, 1)
        return law, float(peak)

    def law(self, setpoint: float) -> Law:
        """The law at a set point (rad/s)."""
        law, _ = self.continuous(setpoint)
        held = ct.sample_system(law, self.config.control_period, "zoh")
        a, scale = matrix_balance(held.A, permute=False)
        b, c, d = held.B[:, 0] / np.diag(scale), held.C[0] * np.diag(scale), float(held.D[0, 0])
        # Observer form: the memory is led back to what would have given the clipped voltage.
        # A steady Kalman gain for u = c x makes the clipped loop stable.
        p = solve_discrete_are(a.T, c[:, None], np.eye(len(a)), [[1.0]])
        back = (a @ p @ c) / float(c @ p @ c + 1.0)
        lower = np.zeros((len(a), 3))
        lower[:, OMEGA_L] = -(b - back * d)
        seen = np.zeros(3)
        seen[OMEGA_L] = -d
        return Law(f=a - np.outer(back, c), g=lower, h=back, m=c, d=seen)
