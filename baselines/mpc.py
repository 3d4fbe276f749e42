"""Model-predictive control that knows the voltage limit, both encoders."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_discrete_are

from drill_env._types import FloatArray
from drill_env.environment.config import EnvConfig

from ._predictive import solve_rigs
from .linear import Law
from .lqi import LQI

_RESOLUTION = 1e-4


class MPC(LQI):
    """`LQI` whose plan over `horizon` periods keeps to the voltage limit.

    Cost, filter and integral are those of `LQI`, the end of the horizon is weighed by its
    Riccati matrix, so that the voltage is the LQI's wherever no limit is met.

    Args:
        config: environment; its rig is the design model.
        horizon: periods planned.
        sweeps: of the coordinate descent, at most.
        **options: of `LQI`.
    """

    def __init__(
        self, config: EnvConfig, horizon: int = 30, sweeps: int = 40, **options: float
    ) -> None:
        super().__init__(config, **options)
        self.horizon, self.sweeps = horizon, sweeps
        self._programs: list[tuple[FloatArray, ...]] = []
        self._plan = np.zeros((0, horizon))

    def program(self, setpoint: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Condensed cost at a set point: G (s, N), H (N, N) and the free plan's gain (N, s)."""
        a, b, weight = self.augmented(setpoint)
        terminal = solve_discrete_are(a, b[:, None], weight, [[self.effort]])
        n, steps = len(a), self.horizon
        hessian, pull = self.effort * np.eye(steps), np.zeros((n, steps))
        reach, power = np.zeros((n, steps)), np.eye(n)
        for k in range(steps):
            reach, power = a @ reach, a @ power
            reach[:, k] = b
            cost = terminal if k == steps - 1 else weight
            hessian += reach.T @ cost @ reach
            pull += power.T @ cost @ reach
        gain = -np.linalg.solve(hessian, pull.T)
        return pull, hessian, gain.astype(float)

    def law(self, setpoint: float) -> Law:
        """The law at a set point where no limit is met: that of `LQI`."""
        system, correct, _ = self._parts(setpoint)
        blind = np.eye(len(system.A)) - correct @ system.C
        self._programs.append((*self.program(setpoint), blind, correct))
        return super().law(setpoint)

    def reset(self, n: int) -> None:
        """Forget every estimate and plan."""
        super().reset(n)
        self._plan = np.zeros((n, self.horizon))

    def memory(self) -> FloatArray:
        """States of the laws and the last plans (V), shape (n, m)."""
        return np.hstack([super().memory(), self._plan])

    def recall(self, memory: FloatArray) -> None:
        """Continue from states of the laws and plans (V), shape (n, m)."""
        super().recall(np.ascontiguousarray(memory[:, : -self.horizon]))
        self._plan = np.ascontiguousarray(memory[:, -self.horizon :])

    def _follow(self, setpoints: FloatArray) -> None:
        super()._follow(setpoints)
        self._tables = [np.array(part) for part in zip(*self._programs, strict=True)]

    def _decide(self, error: FloatArray) -> FloatArray:
        pull, hessian, gain, blind, correct = self._tables
        state = self._memory.copy()
        for j in np.unique(self._index):
            mine = self._index == j
            seen = self._memory[mine, :-1] @ blind[j].T + error[mine] @ correct[j].T
            state[mine, :-1] = seen
        volts = np.empty(len(error))
        solve_rigs(
            self._index, state, self._volts, self.config.voltage_limit, pull, hessian, gain,
            _RESOLUTION, self.sweeps, self._plan, np.zeros(self.horizon), volts,
        )  # fmt: skip
        return volts
