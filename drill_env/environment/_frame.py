"""What the picture shows: one instant, and the last seconds."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from drill_env._types import FloatArray
from drill_env.environment._drawing import minus


@dataclass(frozen=True, slots=True)
class Frame:
    """One instant to draw, in SI units.

    Attributes:
        t: time in s.
        theta_u: angle of the upper disc in rad.
        theta_l: angle of the lower disc in rad.
        omega_u: speed of the upper disc in rad/s.
        omega_l: speed of the lower disc in rad/s.
        setpoint: speed asked of the discs in rad/s, nan if none.
        voltage: motor voltage in V.
        voltage_limit: largest voltage magnitude in V, above 0.
        stuck_u: whether the upper disc sticks.
        stuck_l: whether the lower disc sticks.
        reward: reward of the last step, nan before the first.
    """

    t: float
    theta_u: float
    theta_l: float
    omega_u: float
    omega_l: float
    setpoint: float
    voltage: float
    voltage_limit: float
    stuck_u: bool
    stuck_l: bool
    reward: float


class Traces:
    """The frames of the last seconds, thinned to what the picture can resolve."""

    _RESOLUTION = 600

    def __init__(self, window_s: float) -> None:
        """Start empty.

        Args:
            window_s: seconds to keep.
        """
        self.window_s = window_s
        self.frames: deque[Frame] = deque()

    def add(self, frame: Frame) -> None:
        """Append a frame and forget what left the window.

        A frame at the last one's time replaces it; one before it starts anew.

        Args:
            frame: the newest frame.
        """
        frames = self.frames
        if frames and frame.t < frames[-1].t:
            frames.clear()
        gap = self.window_s / self._RESOLUTION
        crowded = len(frames) > 1 and frame.t - frames[-2].t < gap
        if frames and (crowded or frame.t == frames[-1].t):
            frames.pop()
        frames.append(frame)
        # One frame before the window stays, so that the curves reach its left edge.
        while len(frames) > 1 and frames[1].t <= frame.t - self.window_s:
            frames.popleft()

    def column(self, name: str) -> FloatArray:
        """Collect one field of the frames.

        Args:
            name: field of `Frame`.

        Returns:
            Its values, oldest first, shape (n,).
        """
        return np.array([getattr(frame, name) for frame in self.frames], dtype=np.float64)


def readable(value: float) -> str:
    """Format a value for reading at a glance, in eight characters at most."""
    if not isfinite(value):
        return "\u2013"
    if abs(value) >= 99_999.5:
        return minus(f"{value:.1e}")
    string = f"{value:.{2 if abs(value) < 999.995 else 1 if abs(value) < 9999.95 else 0}f}"
    return minus("0.00" if string == "-0.00" else string)


def stretches(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First true index of each run and the index just after it, or the last there is."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    ends = np.minimum(edges[1::2], len(mask) - 1)
    return list(zip(edges[::2].tolist(), ends.tolist(), strict=True))
