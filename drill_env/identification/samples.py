"""Recordings as the filter reads them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray, IntArray
from drill_env.effects.declared import Declared, bundled
from drill_env.identification._filter_state import N_START, START_OFFSET
from drill_env.identification.initial_state import state_at
from drill_env.identification.known_loads import known_effects, mean_loads
from drill_env.identification.readings import (
    READINGS,
    START_ANGLE,
    doubt_what_velocities_hide,
    made_of_twist,
    readings_of,
)
from drill_env.parameters import Rig
from drill_env.recordings import Channel, Recording

# Doubt about the velocities that a restart takes from the samples around it.
_START_SPEED = 0.3

OFFSET = START_OFFSET
"""Place in `Samples.starts` of the twist at which the encoders agree."""

NOTHING = bundled(())
"""No effects."""


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """One recording as the filter reads it.

    Attributes:
        recording: where it came from.
        t: times from 0, s, shape (n,).
        u: held voltages, V, or torques, Nm, which km = 1 goes with; shape (n,).
        angles: theta_u and theta_l, rad, and where a velocity is recorded omega_u and omega_l,
            rad/s; NaN where missing, shape (n, 2) or (n, 4).
        repeats: samples that share one rounding error, shape as of `angles`.
        loads: known torques on the discs, the mean over the interval after each row, Nm, shape
            (n, 2). Those that were measured are in it from the start.
        restarts: rows where the state is unknown, shape (m,).
        starts: first guess of theta_u - theta_l, omega_u, omega_l, theta_l there and of the
            twist at which the encoders agree, shape (m, 5).
        spreads: standard deviations of the guess, 0 for what is known, shape (m, 5).
        acting: effects that the filter takes at its own state.
        release: innovations beyond so many standard deviations free a disc that the rig holds;
            0 for never. A search for missing physics must follow rigs that are wrong.
        relative: whether theta_l was made of theta_u and a measured twist, see `made_of_twist`.
    """

    recording: Recording
    t: FloatArray
    u: FloatArray
    angles: FloatArray
    repeats: FloatArray
    loads: FloatArray
    restarts: IntArray
    starts: FloatArray
    spreads: FloatArray
    acting: Declared = NOTHING
    release: float = 0.0
    relative: bool = False

    @property
    def names(self) -> tuple[Channel, ...]:
        """The channels that `angles` holds."""
        return READINGS[: self.angles.shape[1]]

    def misread(self, errors: FloatArray) -> FloatArray:
        """Errors of the readings when the sensors mistake the discs' angles.

        A disc of which only the velocity is read has a sensor whose error is the derivative.
        A lower angle that was made of the upper one has that one's error too.

        Args:
            errors: of both sensors' angles, rad, shape (n, 2) or (n, 2, m).

        Returns:
            Shape (n, readings) or (n, readings, m).
        """
        if self.relative:
            errors = np.stack([errors[:, 0], errors[:, 0] + errors[:, 1]], axis=1)
        if self.angles.shape[1] == 2:
            return errors
        out = np.zeros((len(self.t), 4, *errors.shape[2:]))
        out[:, :2] = errors
        for disc in range(2):
            if np.isnan(self.angles[:, disc]).all():
                out[:, 2 + disc] = np.gradient(errors[:, disc], self.t, axis=0)
        return out


def prepare(
    recording: Recording,
    rig: Rig,
    *,
    window: float = math.inf,
    offset: float = 0.1,
    relative: bool | None = None,
) -> Samples:
    """Make a recording ready for the filter.

    Args:
        recording: with u and theta_u or theta_l, or a velocity.
        rig: tells a one-inertia rig from a whole one.
        window: s after which the state is forgotten and estimated anew (multiple shooting).
        offset: standard deviation of the twist that the encoders do not show at their zeros,
            rad.
        relative: whether theta_l was made of theta_u and a measured twist; by default, whether this
            recording's noise says so.

    Raises:
        InputError: a channel is missing, or an argument or a known effect is out of range.
    """
    if not window > 0:
        raise InputError(f"window is {window}: give seconds greater than 0")
    known_effects(rig, recording)
    t = recording.t - recording.t[0]
    u = recording.channel("u")
    if relative is None:
        relative = rig.inertias == 2 and made_of_twist([recording])
    angles, repeats = readings_of(recording, rig, relative=relative)
    restarts = _restarts(t, recording.interval, window)
    starts = np.zeros((len(restarts), N_START))
    spreads = np.zeros((len(restarts), N_START))
    for i, row in enumerate(restarts.tolist()):
        starts[i, :4] = state_at(recording, rig, row)
        still = row == 0 and starts[i, 1] == 0.0 and starts[i, 2] == 0.0
        spreads[i, :4] = (START_ANGLE, *([0.0 if still else _START_SPEED] * 2), START_ANGLE)
        spreads[i, 4] = offset
        if recording.drive == "motion":
            # Any other velocity would lead away from the motion that u was made of.
            spreads[i, 1] = 0.0
        if rig.inertias == 1:
            spreads[i, 2:] = (0.0, START_ANGLE, 0.0)
            spreads[i, 0] = 0.0
        if recording.velocities():
            doubt_what_velocities_hide(spreads[i], recording, rig)
    return Samples(
        recording, t, u, angles, repeats, mean_loads(recording), restarts, starts, spreads,
        relative=relative,
    )  # fmt: skip


def _restarts(t: FloatArray, interval: float, window: float) -> IntArray:
    # Across a gap the voltage is not known.
    rows = [0, *(np.flatnonzero(np.diff(t) > 1.6 * interval) + 1).tolist()]
    if math.isfinite(window):
        rows += np.searchsorted(t, np.arange(window, t[-1], window) - 1e-9).tolist()
    return np.unique(np.array(rows, dtype=np.int64))
