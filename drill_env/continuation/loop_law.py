"""A controller's update as a function of what it reads, with its derivatives."""

from __future__ import annotations

from typing import cast

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.controllers import Controller, Remembering

_STEP = 1e-6
# Single-precision controllers show their rounding in differences as small as _STEP.
_COARSE_STEP = 2e-3
_ROUNDING = 1e-10
_TRIES = 4


class HiddenMemoryError(InputError):
    """The controller keeps a memory that cannot be read, so its loop cannot be continued."""


class ControlLaw:
    """(observation, memory) to (voltage, memory), differentiated by central differences.

    Args:
        controller: the controller; it is reset.
        entries: length of its observation.

    Raises:
        HiddenMemoryError: it has a memory that cannot be read.
    """

    def __init__(self, controller: Controller, entries: int) -> None:
        self._controller, self.entries = controller, entries
        self._keeps = isinstance(controller, Remembering)
        self.size = len(self.fresh(_some(entries)))
        self.rounded = self._rounds()
        if not self._keeps:
            self._check_forgets()

    def fresh(self, observation: FloatArray) -> FloatArray:
        """Memory after the first call of `act`, shape (m,)."""
        if not self._keeps:
            return np.zeros(0)
        self._controller.reset(1)
        self._controller.act(observation[None, : self.entries])
        return cast(Remembering, self._controller).memory()[0]

    def resting(self, observation: FloatArray, volts: float) -> FloatArray:
        """Memory with which it keeps returning `volts` (V), or nearly so, shape (m,)."""
        memory = self.fresh(observation)
        for _ in range(_TRIES if self.size else 0):
            outputs, slopes = self.differentiate(np.append(observation, memory))
            miss = outputs - np.append(volts, memory)
            matrix = slopes[:, self.entries :] - np.eye(1 + self.size)[:, 1:]
            # The least change: several memories may give the same voltage.
            memory = memory - np.linalg.lstsq(matrix, miss, rcond=1e-9)[0]
        return memory

    def __call__(self, inputs: FloatArray) -> FloatArray:
        """Voltage (V) and new memory, shape (n, 1 + m), of inputs of shape (n, entries + m)."""
        observation, memory = inputs[:, : self.entries], inputs[:, self.entries :]
        self._controller.reset(len(inputs))
        if not self._keeps:
            return np.asarray(self._controller.act(observation), dtype=float)[:, None]
        keeper = cast(Remembering, self._controller)
        keeper.recall(memory)
        volts = np.asarray(keeper.act(observation), dtype=float)
        return np.column_stack([volts, keeper.memory()])

    def differentiate(self, inputs: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Outputs (1 + m,) of inputs (k,) and their derivative, shape (1 + m, k)."""
        steps = (_COARSE_STEP if self.rounded else _STEP) * (1.0 + np.abs(inputs))
        moves = np.diag(steps)
        rows = self(np.vstack([inputs, inputs + moves, inputs - moves]))
        count = len(inputs)
        slopes = (rows[1 : count + 1] - rows[count + 1 :]) / (2.0 * steps[:, None])
        return rows[0], slopes.T

    def _rounds(self) -> bool:
        """Whether it computes in single precision: neighbours then do not lie on a line."""
        seen = _some(self.entries)
        middle = np.append(seen, self.fresh(seen))
        moves = _STEP * np.arange(8.0)[:, None] * _some(len(middle))
        volts = self(middle + moves)[:, 0]
        return bool(np.abs(np.diff(volts, 2)).max() > _ROUNDING)

    def _check_forgets(self) -> None:
        """A controller with a hidden memory would be taken for another one."""
        self._controller.reset(1)
        here, there = _some(self.entries)[None], 1.5 * _some(self.entries)[None]
        first = self._controller.act(here)
        for _ in range(3):
            self._controller.act(there)
        if not np.array_equal(first, self._controller.act(here)):
            raise HiddenMemoryError(
                "the controller keeps a memory that cannot be read: give it the methods memory() "
                "and recall() of drill_env.controllers.Remembering to have its loop continued"
            )


def _some(count: int) -> FloatArray:
    """Numbers of order 1, all different."""
    return 0.7 + 0.2 * np.cos(np.arange(count))
