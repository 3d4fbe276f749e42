"""What a simulation returns: sampled states, disc modes and located events."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from drill_env._types import BoolArray, FloatArray, IntArray
from drill_env.integrator.voltage import Voltage


class Disc(IntEnum):
    """Which disc an event belongs to."""

    UPPER = 0
    LOWER = 1
    LOWER_LAW = 2
    EFFECT = 3


class Kind(IntEnum):
    """What happens at an event.

    ``STICK``: the disc comes to rest and stays. ``SLIP``: it breaks away.
    ``REVERSAL``: its velocity passes through zero. ``MAXIMUM``/``MINIMUM``: turning
    points of omega_l, on request. ``CLAMP``: the clamped law switches. ``SWITCH``: an effect
    passes a corner or a jump.
    """

    STICK = 0
    SLIP = 1
    REVERSAL = 2
    MAXIMUM = 3
    MINIMUM = 4
    CLAMP = 5
    SWITCH = 6


@dataclass(frozen=True, slots=True)
class Events:
    """Events in order of time.

    Attributes:
        t: times in s, shape (k,).
        disc: `Disc` codes, shape (k,).
        kind: `Kind` codes, shape (k,).
        state: (twist, omega_u, omega_l, theta_l) at the event, shape (k, 4).
    """

    t: FloatArray
    disc: IntArray
    kind: IntArray
    state: FloatArray

    @classmethod
    def from_log(cls, log: np.ndarray) -> Events:
        """Events out of the integrator's records."""
        return cls(*(np.ascontiguousarray(log[name]) for name in ("t", "disc", "kind", "y")))

    def __len__(self) -> int:
        return len(self.t)

    def where(self, disc: Disc | None = None, kind: Kind | None = None) -> Events:
        """The events of one disc, one kind, or both."""
        keep = np.ones(len(self.t), dtype=bool)
        if disc is not None:
            keep &= self.disc == disc
        if kind is not None:
            keep &= self.kind == kind
        return Events(self.t[keep], self.disc[keep], self.kind[keep], self.state[keep])


@dataclass(frozen=True, slots=True)
class Trajectory:
    """A simulated run.

    Attributes:
        t: sample times in s, shape (n,).
        state: (twist, omega_u, omega_l, theta_l) in rad and rad/s, shape (n, 4).
        modes: slip direction of (upper, lower) disc, 0 when stuck, shape (n, 2).
        voltage: the voltage that drove the run.
        events: located events.
        sensitivity: d state / d (initial state, parameters, numbers of the effects in the order of
            the rig's), shape (n, 4, 18 + k), or empty.
        final_state: state at the end, shape (4,).
        final_modes: (upper, lower, clamped) at the end, shape (3,).
        max_speed: largest abs(omega_l) at any step, rad/s.
        steps: accepted and rejected steps.
        inner: inner states of the rig's effects at the samples, shape (n, m).
        final_inner: those at the end, shape (m,).
        final_sensitivity: with effects and sensitivities, d (state, inner states) at the end /
            d (as `sensitivity`, then the first inner states), shape (4 + m, 18 + k + m).
        errors: of the encoders of theta_u and theta_l at the samples by the rig's effects, rad,
            shape (n, 2), or empty.
    """

    t: FloatArray
    state: FloatArray
    modes: IntArray
    voltage: Voltage
    events: Events
    sensitivity: FloatArray
    final_state: FloatArray
    final_modes: IntArray
    max_speed: float
    steps: int
    inner: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    final_inner: FloatArray = field(default_factory=lambda: np.zeros(0))
    errors: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    final_sensitivity: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def twist(self) -> FloatArray:
        """theta_u - theta_l (rad)."""
        return self.state[:, 0]

    @property
    def omega_u(self) -> FloatArray:
        """Upper-disc velocity (rad/s)."""
        return self.state[:, 1]

    @property
    def omega_l(self) -> FloatArray:
        """Lower-disc velocity (rad/s)."""
        return self.state[:, 2]

    @property
    def theta_l(self) -> FloatArray:
        """Lower-disc angle (rad)."""
        return self.state[:, 3]

    @property
    def theta_u(self) -> FloatArray:
        """Upper-disc angle (rad)."""
        return self.state[:, 0] + self.state[:, 3]

    @property
    def readings(self) -> FloatArray:
        """theta_u and theta_l (rad) with the errors of sensors' effects, shape (n, 2)."""
        angles = np.column_stack([self.theta_u, self.theta_l])
        return angles + self.errors if len(self.errors) else angles

    @property
    def u(self) -> FloatArray:
        """Voltage at the samples (V)."""
        return self.voltage(self.t)

    @property
    def stuck_u(self) -> BoolArray:
        """Whether the upper disc sticks."""
        return self.modes[:, 0] == 0

    @property
    def stuck_l(self) -> BoolArray:
        """Whether the lower disc sticks."""
        return self.modes[:, 1] == 0
