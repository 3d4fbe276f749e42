"""Profile-likelihood intervals, for parameters whose likelihood is not quadratic."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.identification.coordinates import POSITIVE, Coordinates
from drill_env.identification.descent import Point, Problem, point_at, rig_step
from drill_env.identification.estimate import Estimate

_STEPS = 12
_POINTS = 14
_SPACING = 0.7
_FARTHEST = 1e3


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """The likelihood along one parameter, all others at their best.

    Attributes:
        name: the parameter.
        values: tried values, ascending, shape (n,).
        rise: how much minus twice the log likelihood lies above its minimum, shape (n,).
        low: lower end of the interval, minus infinity where the recordings set none.
        high: upper end of the interval, infinity where the recordings set none.
        level: probability that the interval holds the true value.
    """

    name: str
    values: FloatArray
    rise: FloatArray
    low: float
    high: float
    level: float


def profile(
    estimate: Estimate,
    name: str,
    *,
    level: float = 0.95,
    report: Callable[[int, float], None] | None = None,
) -> Profile:
    """Profile likelihood of one parameter, with the noise held.

    Args:
        estimate: from `identify`.
        name: a free parameter.
        level: probability that the interval holds the true value.
        report: called with (number of values tried, rise of the last one).

    Raises:
        InputError: the parameter is not free, or is the only free one.
    """
    if name not in estimate.free:
        raise InputError(f"{name} is not among the free ones, {', '.join(estimate.free)}")
    if len(estimate.free) == 1:
        raise InputError(f"{name} alone is free: its interval needs no profile")
    threshold = float(chi2.ppf(level, 1))
    centre = getattr(estimate.rig, name)
    deviation = math.sqrt(estimate.covariance[i := estimate.free.index(name), i])
    tried: dict[float, float] = {centre: 0.0}
    ends = []
    for side in (-1.0, 1.0):
        found = _side(estimate, name, side, deviation, threshold, len(tried), report)
        tried |= found
        ends.append(_crossing(centre, found, threshold, side))
    values = np.array(sorted(tried))
    return Profile(name, values, np.array([tried[v] for v in values]), ends[0], ends[1], level)


def _side(
    estimate: Estimate,
    name: str,
    side: float,
    deviation: float,
    threshold: float,
    done: int,
    report: Callable[[int, float], None] | None,
) -> dict[float, float]:
    """Values on one side of the estimate and the rise there, until past the threshold."""
    found: dict[float, float] = {}
    centre = getattr(estimate.rig, name)
    # The weak prior around the start is not data.
    reached = replace(estimate.problem, doubt=math.inf)
    here = point_at(reached, estimate.point.vector, estimate.point.noise, estimate.point.starts)
    lowest = here.value
    spacing = _SPACING * deviation
    distance = 0.0
    for _ in range(_POINTS):
        distance += spacing
        value = centre + side * distance
        if name in POSITIVE:
            # The same distance on a logarithmic scale, which never leaves the positive side.
            value = centre * math.exp(side * distance / centre)
        moved = _at_value(reached, here, name, value)
        if moved is None:
            break
        reached, here = moved
        rise = here.value - lowest
        found[value] = rise
        if report:
            report(done + len(found), rise)
        if rise > threshold or distance > _FARTHEST * deviation:
            break
        # Far below the threshold the curve is flat: stride out.
        spacing *= 2.0 if rise < 0.3 * threshold * (distance / deviation) ** 2 / 4.0 else 1.0
    return found


def _at_value(
    problem: Problem, here: Point, name: str, value: float
) -> tuple[Problem, Point] | None:
    """The lowest point with one parameter held at a value, from the neighbouring one."""
    free = tuple(n for n in problem.coordinates.free if n != name)
    try:
        rig = here.rig.replace(**{name: value})
        coordinates = Coordinates(rig, free)
        held = replace(problem, coordinates=coordinates)
        there = point_at(held, coordinates.vector(rig), here.noise, here.starts)
    except InputError:
        return None
    damping = 1e-4
    for _ in range(_STEPS):
        before = there.value
        there, damping = rig_step(held, there, min(damping, 1.0))
        if before - there.value < 0.01:
            break
    return replace(held, coordinates=problem.coordinates), there


def _crossing(centre: float, found: dict[float, float], threshold: float, side: float) -> float:
    """Where the square root of the rise, nearly linear in the value, meets the threshold."""
    values = [centre, *found]
    roots = [0.0, *(math.sqrt(max(rise, 0.0)) for rise in found.values())]
    target = math.sqrt(threshold)
    for a, b, low, high in zip(values, values[1:], roots, roots[1:], strict=False):
        if low <= target < high:
            return a + (b - a) * (target - low) / (high - low)
    return side * math.inf


def profiles(estimate: Estimate, names: Sequence[str], *, level: float = 0.95) -> list[Profile]:
    """Profiles of several parameters."""
    return [profile(estimate, name, level=level) for name in names]
