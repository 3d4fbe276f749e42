"""What continuation needs of a flow, and what it finds: shots, closed cycles, failures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol, TypeAlias

from drill_env._types import ComplexArray, FloatArray
from drill_env.integrator.trajectory import Events
from drill_env.parameters import Rig

Character: TypeAlias = Literal["slipping", "sticking", "reversing", "reversing and sticking"]
"""What the lower disc does within a period."""


class CycleError(RuntimeError):
    """A limit cycle could not be computed; the message says which step failed and why."""


@dataclass(frozen=True, slots=True)
class LimitCycle:
    """A periodic motion, from one maximum of omega_l to the next.

    Attributes:
        parameter: value of the continued parameter (V for the voltage).
        state: (twist, omega_u, omega_l, ...) at the maximum, shape (n,); n is 3 without a
            controller.
        period: s.
        min: smallest omega_l, rad/s.
        max: largest omega_l, rad/s.
        multipliers: Floquet multipliers but the trivial one, by falling size; n - 1 complex.
            A cycle that sticks has the multiplier 0: states merge in finite time.
        trivial: the multiplier along the flow, 1 up to the error of the computation.
        stable: all multipliers inside the unit circle.
        character: whether the lower disc sticks or reverses within the period.
        sticking_s: time stuck per period, s.
        reversed_s: time with omega_l < 0 per period, s.
        hits: stiction margin Tsl - abs(ktheta twist) (Nm) whenever omega_l reaches 0.
        steps: Newton steps taken.
        residual: distance by which the last period fails to close.
    """

    parameter: float
    state: FloatArray
    period: float
    min: float
    max: float
    multipliers: ComplexArray
    trivial: float
    stable: bool
    character: Character
    sticking_s: float
    reversed_s: float
    hits: tuple[float, ...]
    steps: int
    residual: float


@dataclass(frozen=True, slots=True)
class Shot:
    """One period integrated from a maximum of omega_l.

    Attributes:
        end: state after the period, shape (n,).
        jacobian: d end / d (state, period, parameter), shape (n, n + 2).
        events: what happened.
    """

    end: FloatArray
    jacobian: FloatArray
    events: Events


class Flow(Protocol):
    """A flow whose cycles can be continued; z is (state, period, parameter)."""

    def rig_at(self, value: float) -> Rig:
        """The rig with the continued parameter set."""
        ...

    def shoot(self, state: FloatArray, period: float, value: float) -> Shot:
        """Integrate one period and its derivatives.

        Raises:
            CycleError: the integration failed.
        """
        ...

    def phase(self, state: FloatArray, value: float) -> tuple[float, FloatArray]:
        """Condition that singles out one state of a cycle, and its gradient by z."""
        ...

    def describe(self, shot: Shot, z: FloatArray, steps: int) -> LimitCycle:
        """The closed cycle of `z`, found after `steps` Newton steps."""
        ...
