"""What the filter reads of a recording, and what its readings leave open at the start."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from drill_env._types import FloatArray
from drill_env.friction import lower_curve
from drill_env.identification.noise import clipped_shivers, repeated_counts
from drill_env.parameters import Rig
from drill_env.recordings import Channel, Recording

READINGS: tuple[Channel, ...] = ("theta_u", "theta_l", "omega_u", "omega_l")
"""In the order of the filter's columns; the velocities are there where one is recorded."""

# How far from 1 the share of the upper sensor's noise in the lower angle may be.
_FOLLOWS = 0.3
# Differences of two counted angles that are no further apart, rad, are the same count.
_SAME = 1e-9

START_ANGLE = 0.05
"""Doubt about the angles that a restart takes from the samples around it, rad."""


def made_of_twist(recordings: Sequence[Recording]) -> bool:
    """Whether theta_l was made of theta_u and a measured twist, and has the noise of both.

    A flexible joint's deflection is often measured from the hub. In high differences little is left
    but noise: of sensors apart, the lower one's does not follow the upper one's; of such, it does.
    Where the clock is uncertain it does, too, but in the ratio of the speeds.
    """
    product = square = straight = timed = 0.0
    for recording in recordings:
        angles = recording.angles()
        if len(angles) < 2:
            continue
        upper, lower = (clipped_shivers(angles[name]) for name in READINGS[:2])
        known = np.isfinite(upper) & np.isfinite(lower)
        product += float(upper[known] @ lower[known])
        square += float(upper[known] @ upper[known])
        fast_u, fast_l = (
            _turned_meanwhile(angles[name], len(upper))[known] for name in READINGS[:2]
        )
        straight += float(np.nansum(((lower[known] - upper[known]) * fast_u) ** 2))
        timed += float(np.nansum((lower[known] * fast_u - upper[known] * fast_l) ** 2))
    follows = square > 0.0 and abs(product / square - 1.0) < _FOLLOWS
    return follows and straight <= timed


def _turned_meanwhile(angle: FloatArray, rows: int) -> FloatArray:
    """By how much a disc turned while each of so many high differences was taken, rad."""
    return angle[len(angle) - rows :] - angle[:rows]


def readings_of(
    recording: Recording, rig: Rig, *, relative: bool = False
) -> tuple[FloatArray, FloatArray]:
    """The readings as `Samples.angles`, and how many samples share a rounding error."""
    discs = "u" if rig.inertias == 1 else "ul"
    found = {n: v for n, v in recording.readings().items() if n[-1] in discs}
    if not found:
        recording.channel("theta_u")
    names = READINGS if any(n in found for n in READINGS[2:]) else READINGS[:2]
    angles = np.full((len(recording), len(names)), math.nan)
    repeats = np.ones(angles.shape)
    for place, name in enumerate(names):
        if name in found:
            angles[:, place] = found[name]
            # A velocity's step need not be known: noise does not repeat itself.
            if name in recording.quanta or place > 1:
                repeats[:, place] = repeated_counts(found[name])
    if relative and "theta_l" in found:
        repeats[:, 1] = repeated_counts(np.rint((angles[:, 0] - angles[:, 1]) / _SAME))
    return angles, repeats


def doubt_what_velocities_hide(spread: FloatArray, recording: Recording, rig: Rig) -> None:
    """Hold an angle that nothing tells, and free the twist, which only the motion then tells."""
    if rig.inertias == 1:
        spread[3] = 0.0 if recording.theta_u is None else spread[3]
    elif len(recording.angles()) < 2:
        spread[0] = 0.0 if recording.theta_u is None else START_ANGLE
        spread[3] = 0.0 if recording.theta_l is None else START_ANGLE
        spread[4] = max(spread[4], _doubt_of_twist(recording, rig))


def _doubt_of_twist(recording: Recording, rig: Rig) -> float:
    """How far the string's twist may be from a steady run's where only velocities tell it, rad."""
    fastest = max(float(np.nanmax(np.abs(v))) for v in recording.velocities().values())
    friction = float(lower_curve(rig, np.linspace(0.0, fastest, 50)).max()) / rig.ktheta
    return friction + fastest * rig.natural_period / (2.0 * math.pi)
