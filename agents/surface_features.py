"""What a policy with the upper encoder alone reads: estimates of the adaptive Kalman filter."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from drill_env._types import FloatArray
from drill_env.baselines.adaptive_ekf import UNKNOWN, AdaptiveEKF
from drill_env.environment.config import EnvConfig

from .features import LOG_MIDDLE, PULSE, push_scale, reference_table

_TWIST, _OMEGA_L, _FREE, _FRICTION, _KTHETA = 0, 2, 8, 2, 3
_WIDEST = 10.0
# What the estimates are measured in: about their spread at L3, the delay in 0.1 s.
_UNITS = np.array([0.1, 0.1, 0.5, 0.2, 0.15, 0.1, 0.1])


class SurfaceFilter:
    """Twist and speeds as the adaptive filter estimates them, its plant and how sure it is.

    The filter of `baselines.AdaptiveEKF` runs inside, with the gains it was tuned with; it knows
    the voltage that was applied, whoever chose it. The voltage is that of the filter's own
    regulator plus the policy's output in units of `push_scale`.

    Args:
        config: environment; its rig is where the filter's estimates start.
        gains: of the filter.
        table: see `features.reference_table`; made from the rig if it is left out.
    """

    def __init__(
        self, config: EnvConfig, gains: Mapping[str, Any], table: FloatArray | None = None
    ) -> None:
        self.table = reference_table(config) if table is None else table
        self.history, self.limit = config.history, config.voltage_limit
        self._filter = AdaptiveEKF(config, **gains)
        self.size = 2 * (1 + self.history) + 4 + 6 + 2 * len(UNKNOWN) + 2
        self.reset(0)

    def reset(self, n: int) -> None:
        """Forget every estimate."""
        self._filter.reset(n)
        self._advised = self._push = np.zeros(n)

    def read(self, observation: FloatArray) -> FloatArray:
        """Features of an observation; to be called once a period."""
        self._advised = self._filter.act(observation)
        setpoint = observation[:, 1]
        points, volts, twist = self.table.T
        self._push, middle = push_scale(setpoint), np.interp(setpoint, points, volts)
        estimate, plant = self._filter.x, self._filter.x[:, _FREE:]
        stretch = np.exp(plant[:, _FRICTION] - plant[:, _KTHETA])
        reference = np.interp(setpoint, points, twist) * stretch
        state = estimate[:, : _OMEGA_L + 1]
        relative = (state - np.column_stack([reference, setpoint, setpoint])) / setpoint[:, None]
        relative[:, _TWIST] *= PULSE
        frames = np.concatenate([observation[:, :1], observation[:, 2:]], axis=1)
        seen = (frames[:, ::2] - setpoint[:, None]) / setpoint[:, None]
        applied = (frames[:, 1::2] - middle[:, None]) / self._push[:, None]
        advice = (self._advised - middle) / self._push
        plain = np.column_stack([state, setpoint - 4.0, self._advised]) / 4.0
        whole = np.column_stack([
            np.arcsinh(np.column_stack([relative, seen, applied, advice])), plain,
            np.log(setpoint) - LOG_MIDDLE, plant / _UNITS, *self._doubts(setpoint),
        ])  # fmt: skip
        # A filter that has lost itself starts anew in the next period.
        return np.clip(np.nan_to_num(whole), -_WIDEST, _WIDEST)

    def _doubts(self, setpoint: FloatArray) -> tuple[FloatArray, ...]:
        """Standard deviations of the estimates."""
        spread = np.sqrt(np.einsum("nii->ni", self._filter.covariance).clip(0.0))
        state = np.arcsinh(spread[:, [_TWIST, _OMEGA_L]] / setpoint[:, None])
        return spread[:, _FREE:] / _UNITS, state

    def volts(self, output: FloatArray) -> FloatArray:
        """Voltage (V) within the limit."""
        return np.clip(self._advised + self._push * output, -self.limit, self.limit)
