"""Output feedback over an observer with set-valued friction, judged by Popov's criterion.

De Bruin, Doris, van de Wouw, Heemels and Nijmeijer, Automatica 45 (2009) 405-415.
"""

from __future__ import annotations

import control as ct
import numpy as np

from drill_env._types import FloatArray
from drill_env.dynamics import equilibrium_voltage
from drill_env.environment.config import EnvConfig, View
from drill_env.friction import kernel_record, lower_curve
from drill_env.friction.kernels import map_lower

from . import _filter as kernels
from ._observer import observe_rigs
from .linear import OMEGA_L, noise_levels, rig_matrices

_FREQUENCIES = np.geomspace(1e-2, 1e3, 600)
_MULTIPLIERS = np.concatenate([[0.0], np.geomspace(1e-2, 1e2, 81)])


def steepest_fall(config: EnvConfig) -> float:
    """Most negative slope of the lower friction law up to 60 rad/s, Nm s/rad, as a size."""
    speeds = np.geomspace(1e-3, 60.0, 4000)
    slopes = np.empty_like(speeds)
    map_lower(kernel_record(config.rig)[0], speeds, True, slopes)
    return max(float(-slopes.min()), 0.0)


class SetValuedObserver:
    """u = u_eq - K (x_hat - x_eq), x_hat from a copy of the rig, stick and all.

    Friction plus its steepest fall is monotone, so that Popov's criterion on what is left, a
    linear system, gives stability for any friction that falls no faster (and
    input-to-state stability towards noise).

    Rule: K is the quadratic regulator of that worst slope; of the efforts 0.01 to 100 the
    largest for which the criterion holds is taken. The correction is the steady Kalman gain
    there. There is no integral: a wrong model gives bias.

    Args:
        config: environment; its rig is the design model.
        effort: weight of volts^2; by the rule if not given.
        lower: unmodelled change of omega_l in a period, rad/s.
    """

    view: View = "both"
    history: int = 0

    def __init__(self, config: EnvConfig, effort: float | None = None, lower: float = 0.05) -> None:
        self.config = config
        self._a, self._b = rig_matrices(config.rig, 1.0)
        self._a[OMEGA_L, OMEGA_L] = steepest_fall(config) / config.rig.Jl
        self.feedback = self._feedback(self._largest_effort() if effort is None else effort)
        self._gain = self._correction(lower)
        self._p, self._top = kernel_record(config.rig), np.zeros((3, kernels.N_TOP))
        self._x, self._fresh = np.zeros((0, kernels.FREE)), True

    def _largest_effort(self) -> float:
        efforts = np.geomspace(100.0, 0.01, 41).tolist()
        return next((e for e in efforts if self._popov(self._feedback(e)) > 0.0), efforts[-1])

    def _feedback(self, effort: float) -> FloatArray:
        weight = np.array([[0.0, 0.0, 0.0], [0.0, 1.0, -1.0], [0.0, -1.0, 2.0]])
        return np.asarray(ct.lqr(self._a, self._b[:, None], weight, [[effort]])[0])[0]

    def _popov(self, feedback: FloatArray) -> float:
        """Largest over the multipliers of the least Re (1 + j g w) G(jw), scaled by |G|."""
        closed = self._a - np.outer(self._b, feedback)
        push = np.zeros((3, 1))
        push[OMEGA_L] = 1.0 / self.config.rig.Jl
        loop = ct.StateSpace(closed, push, np.eye(3)[[OMEGA_L]], [[0.0]])
        gain = np.asarray(loop(1j * _FREQUENCIES)).ravel()
        turned = (1.0 + 1j * np.outer(_MULTIPLIERS, _FREQUENCIES)) * gain
        return float((turned.real / np.abs(turned)).min(axis=1).max())

    def popov_margin(self) -> float:
        """Popov's criterion holds if this is above 0: cosine of the worst phase."""
        return self._popov(self.feedback)

    def _correction(self, lower: float) -> FloatArray:
        period = self.config.control_period
        step = ct.sample_system(
            ct.StateSpace(self._a, self._b[:, None], np.eye(3), np.zeros((3, 1))), period
        )
        seen = np.eye(3)[:2]
        measured = np.diag(np.maximum(noise_levels(self.config)[:2], 1e-3) ** 2)
        process = np.diag([1e-10, 1e-2**2, lower**2])
        _, p, _ = ct.dlqe(step.A, np.eye(3), seen, process, measured)
        return np.ascontiguousarray(p @ seen.T @ np.linalg.inv(seen @ p @ seen.T + measured))

    def reset(self, n: int) -> None:
        """Forget every estimate."""
        self._x, self._fresh = np.zeros((n, kernels.FREE)), True

    def memory(self) -> FloatArray:
        """States of the observers, shape (n, m)."""
        return self._x.copy()

    def recall(self, memory: FloatArray) -> None:
        """Continue from states of the observers, shape (n, m)."""
        self._x, self._fresh = np.ascontiguousarray(memory), False

    def act(self, observation: FloatArray) -> FloatArray:
        """Voltage (V) from the measurements, the set point and the last voltage."""
        twist, speed, _, target, last = np.ascontiguousarray(observation[:, :5].T)
        period, rig = self.config.control_period, self.config.rig
        observe_rigs(
            self._fresh, twist, speed, last, self._x, self._p[0], period, self._gain, self._top
        )
        self._fresh = False
        error = self._x[:, :3] - target[:, None]
        error[:, 0] = self._x[:, 0] - lower_curve(rig, target) / rig.ktheta
        return equilibrium_voltage(rig, target) - error @ self.feedback
