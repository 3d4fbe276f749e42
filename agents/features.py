"""What a policy with both encoders reads, and the voltage that its output stands for."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from drill_env._types import FloatArray
from drill_env.dynamics import equilibrium_state, equilibrium_voltage
from drill_env.environment.config import EnvConfig

OUTPUT_BOUND = 4.0
PULSE = 1.5
"""About the string's own frequency, rad/s: twists times it compare with speeds."""
MEAN_TIME = 2.0
SCALES = (5.0, 4.0, 4.0, 4.0, 4.0)
"""Of twist, omega_u, omega_l, set point and voltage where they enter as they are."""
LOG_MIDDLE = 0.7
_KNOTS, _LOWEST, _HIGHEST = 96, 0.1, 12.0


class Features(Protocol):
    """The part of an agent that is not learnt.

    Attributes:
        size: features a row.
        table: see `reference_table`.
    """

    size: int
    table: FloatArray

    def reset(self, n: int) -> None:
        """Forget everything; `n` rigs follow."""
        ...

    def read(self, observation: FloatArray) -> FloatArray:
        """Features of an observation in physical units, shape (n, size)."""
        ...

    def volts(self, output: FloatArray) -> FloatArray:
        """Voltages (V) for the policy's outputs to what was read last, shape (n,)."""
        ...


def reference_table(config: EnvConfig) -> FloatArray:
    """Set point (rad/s), steady voltage (V) and twist (rad) of the nominal rig, shape (k, 3)."""
    points = np.geomspace(_LOWEST, _HIGHEST, _KNOTS)
    rows = [
        (p, float(equilibrium_voltage(config.rig, p)), float(equilibrium_state(config.rig, p)[0]))
        for p in points.tolist()
    ]
    return np.array(rows)


def push_scale(setpoint: FloatArray) -> FloatArray:
    """Volts that one unit of a policy's output moves."""
    return 1.0 + 0.5 * setpoint


def trim_range(setpoint: FloatArray) -> FloatArray:
    """How far the trim may go, V: what friction and viscosity of the widest set may cost."""
    return 0.15 + 0.1 * setpoint


class BothEncoders:
    """Measured frames relative to the set point, present and past, and two slow means.

    The voltage is that of the nominal rig's equilibrium, plus the trim, plus the policy's
    output in units of `push_scale`. The trim follows the voltage that was applied with a time
    constant of 2 s, within `trim_range`: where a run is steady the output must be zero,
    whatever voltage this plant needs, so that a wrong model leaves no bias. Likewise the lean
    follows the twist beyond the nominal rig's: friction of another size moves it far.

    Args:
        table: see `reference_table`.
        history: past frames in the observation.
        limit: V.
        period: of control, s.
    """

    def __init__(self, table: FloatArray, history: int, limit: float, period: float) -> None:
        self.table, self.history, self.limit, self.period = table, history, limit, period
        self.size = 4 * (1 + history) + 8
        self.reset(0)

    def reset(self, n: int) -> None:
        """Forget both means."""
        self.trim, self.lean, self._beyond = (np.zeros(n) for _ in range(3))
        self._setpoint = np.full(n, np.nan)

    def read(self, observation: FloatArray) -> FloatArray:
        """Features of an observation with `history` past frames."""
        setpoint = observation[:, 3]
        if not np.array_equal(setpoint, self._setpoint):
            self._follow(setpoint.copy())
        frames = np.concatenate([observation[:, :3], observation[:, 4:]], axis=1)
        frames = frames.reshape(len(frames), 1 + self.history, 4)
        beyond = frames - self._middle[:, None]
        self._beyond = beyond[:, 0, 0].copy()
        relative = np.arcsinh(beyond * self._per[:, None])
        swing = np.arcsinh((self._beyond - self.lean) * self._per[:, 0])
        plain = observation[:, :5] / SCALES
        plain[:, 3] -= 1.0
        logarithm = np.log(setpoint) - LOG_MIDDLE
        trim = self.trim / self._range
        whole = [relative.reshape(len(frames), -1), plain, logarithm, trim, swing]
        return np.column_stack(whole)

    def _follow(self, setpoint: FloatArray) -> None:
        self._setpoint = setpoint
        points, volts, twist = self.table.T
        self._volts = np.interp(setpoint, points, volts)
        self._push, self._range = push_scale(setpoint), trim_range(setpoint)
        middle = [np.interp(setpoint, points, twist), setpoint, setpoint, self._volts]
        self._middle = np.column_stack(middle)
        per = 1.0 / setpoint
        self._per = np.column_stack([PULSE * per, per, per, 1.0 / self._push])

    def volts(self, output: FloatArray) -> FloatArray:
        """Voltage (V) within the limit; carries the means on."""
        base = self._volts + self.trim
        volts = np.clip(base + self._push * output, -self.limit, self.limit)
        share = self.period / MEAN_TIME
        self.trim = np.clip(self.trim + share * (volts - base), -self._range, self._range)
        self.lean = self.lean + share * (self._beyond - self.lean)
        return volts

    def memory(self) -> FloatArray:
        """Trim (V) and lean (rad), shape (n, 2)."""
        return np.column_stack([self.trim, self.lean])

    def recall(self, memory: FloatArray) -> None:
        """Continue from trims and leans."""
        self.reset(len(memory))
        self.trim, self.lean = memory.T.copy()
