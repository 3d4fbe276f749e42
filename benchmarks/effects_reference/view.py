"""What an effect of the reference sees and what it adds to the equations of motion."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

Law = Callable[[float], float]
MOVING = 0.15  # a rig that starts below this speed (rad/s) was at rest before the start


@dataclass
class Sums:
    """What all effects together add to the equations of motion."""

    read: float
    volts: float = 0.0
    torque_u: float = 0.0
    torque_l: float = 0.0
    string: float = 0.0
    size_u: float = 0.0
    size_l: float = 0.0
    scale_u: float = 0.0
    scale_l: float = 0.0
    inertia_u: float = 0.0
    drive: float = 1.0


@dataclass
class View:
    """What an effect may see: time, voltage, state, directions and its own inner states."""

    rig: Any
    law: Law
    t: float
    inside: float
    """A time strictly inside the present segment, which tells what is switched on in it."""
    u: float
    x: float
    wu: float
    wl: float
    angle_l: float
    su: int
    sl: int
    dwell: float | None
    """Time since the lower disc came to rest, None while it moves."""
    inner: Sequence[float] = ()
    signs: Sequence[int] = ()
    hold: float = 0.0
    """What stands for the sign of w_u: the share of its friction that is taken at rest."""

    @property
    def angle_u(self) -> float:
        return self.x + self.angle_l

    @property
    def speed_u(self) -> float:
        return self.su * self.wu

    @property
    def speed_l(self) -> float:
        return self.sl * self.wl


class Volts:
    """The piecewise-constant voltage."""

    def __init__(self, u: float | Sequence[tuple[float, float]], before: float = 0.0) -> None:
        steps = sorted(u) if isinstance(u, Sequence) else [(0.0, float(u))]
        self.steps = [(float(t), float(v)) for t, v in steps]
        self._starts = [t for t, _ in self.steps]

    def __call__(self, t: float) -> float:
        return self.steps[max(bisect_right(self._starts, t) - 1, 0)][1]


@dataclass
class Start:
    """What an effect needs to set up its memory."""

    rig: Any
    law: Law
    volts: Volts
    state: Sequence[float]
    seconds: float

    @property
    def volts_before(self) -> float:
        return 0.0 if abs(self.state[1]) < MOVING else self.volts(0.0)


class Effect:
    """An effect without memory, kink or switching time; the others override what they need."""

    initial: list[float] = []
    breaks: list[float] = []
    asks_hold = False

    def __init__(self, q: dict[str, Any], start: Start) -> None:
        self.q = q
        self.setup(q, start)

    def setup(self, q: dict[str, Any], start: Start) -> None: ...

    def add(self, s: Sums, v: View) -> None: ...

    def rates(self, v: View) -> list[float]:
        return []

    def switches(self, v: View) -> list[float]:
        return []


def clip(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


def clip_by_signs(value: float, limit: float, signs: Sequence[int]) -> float:
    """The clip, on the piece told by the signs of value - limit and value + limit."""
    if signs[0] > 0:
        return limit
    return value if signs[1] > 0 else -limit
