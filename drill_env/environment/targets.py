"""Set points, schedules and friction steps, checked alike in options and in resets."""

from __future__ import annotations

from typing import Any

from drill_env._checks import real, reals
from drill_env._errors import InputError

SETPOINT_BOUND = 60.0
"""Largest set point, rad/s."""

LONGEST_EPISODE = 1e7
"""s; at the shortest control period a billion steps, which no one simulates."""

LARGEST_FACTOR = 1e3
"""Of a step of the friction: three times the factor at which no voltage turns the lower disc of the
paper's rig, 15 V times 3.5693 Nm/V over the 0.16 Nm of its friction."""


def check_setpoint(value: Any) -> float:
    """A set point in rad/s, or an error."""
    number = real(value, "setpoint")
    if not 0 < number <= SETPOINT_BOUND:
        raise InputError(f"setpoint is {number}: give more than 0 and at most 60 rad/s")
    return number


def checked_schedule(given: Any) -> list[tuple[float, float]]:
    """Pairs of a time (s) and a set point (rad/s).

    Raises:
        InputError: a time is before the start or after the longest episode, or a set point is bad.
    """
    try:
        pairs = [reals(pair, "an entry of schedule", 2) for pair in given]
    except TypeError as error:
        raise InputError(f"schedule is {given!r}: give (time, set point) pairs") from error
    for time, value in pairs:
        check_setpoint(value)
        if not 0 <= time <= LONGEST_EPISODE:
            raise InputError(f"schedule: time is {time}: give 0 to {LONGEST_EPISODE:g} s")
    return [(time, value) for time, value in pairs]


def checked_friction_step(given: Any) -> tuple[tuple[float, float], tuple[float, float]]:
    """Range of the time (s) and of the factor of a step of the lower friction.

    Raises:
        InputError: an end is no finite number, negative or in the wrong order.
    """
    try:
        span, factors = given
    except (TypeError, ValueError) as error:
        raise InputError(
            f"friction_step is {given!r}: give ((early, late), (low, high))"
        ) from error
    early, late = reals(span, "times of friction_step", 2)
    low, high = reals(factors, "factors of friction_step", 2)
    if not (0 <= early <= late <= LONGEST_EPISODE and 0 <= low <= high <= LARGEST_FACTOR):
        raise InputError(
            f"friction_step is {given!r}: give ((early, late), (low, high)), ascending, times to "
            f"{LONGEST_EPISODE:g} s and factors to {LARGEST_FACTOR:g}"
        )
    return (early, late), (low, high)
