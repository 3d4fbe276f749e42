"""Special points of a branch of limit cycles: folds, grazing, sticking and reversal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from scipy.optimize import brentq

from drill_env.continuation.branch import Corrector, Point
from drill_env.continuation.flow import CycleError, LimitCycle

PointKind: TypeAlias = Literal[
    "break-away", "hopf", "fold", "grazing", "reversal", "last stick", "non-smooth fold",
    "neimark-sacker", "period doubling", "real crossing",
]  # fmt: skip
"""What happens at a special point.

``break-away``: the sticking set ends. ``grazing``: min omega_l reaches 0, sticking starts
or ends. ``reversal``: at its first contact the lower disc starts, or stops, to be pulled
through instead of sticking. ``last stick``: the same at a later contact, after which no
phase of sticking is left. ``non-smooth fold``: a cycle with and one without contact meet at
a graze and the branch turns back at once. Of the map over a control period or a cycle:
``neimark-sacker``: a pair of multipliers crosses the unit circle, a sampled loop's Hopf point.
``period doubling``: a multiplier passes -1. ``real crossing``: a multiplier passes 1 where the
branch does not turn back.
"""

_SPLITS = 14
# By so much points move with the steps along the branch: closure and integration errors.
_FLOOR = 2e-9


@dataclass(frozen=True, slots=True)
class SpecialPoint:
    """One special point.

    Attributes:
        name: the paper's letter, or "".
        kind: what happens there.
        parameter: voltage in V, or value of the continued parameter.
        omega: speed of the equilibrium, or NaN for cycles, rad/s.
        min: of omega_l, rad/s.
        max: of omega_l, rad/s.
        period: s; NaN if there is no cycle.
        multipliers: Floquet multipliers but the trivial one; empty for equilibria.
        how: the condition that was solved.
        error: estimated error of `parameter`.
        remark: what is known, and what is inference.
        cycle: the limit cycle there, if it is one.
    """

    name: str
    kind: PointKind
    parameter: float
    omega: float
    min: float
    max: float
    period: float
    multipliers: tuple[complex, ...]
    how: str
    error: float
    remark: str = ""
    cycle: LimitCycle | None = None


def cycle_point(
    kind: PointKind, cycle: LimitCycle, how: str, error: float, name: str = "", remark: str = ""
) -> SpecialPoint:
    """A special point that is a limit cycle."""
    return SpecialPoint(
        name, kind, cycle.parameter, float("nan"), cycle.min, cycle.max, cycle.period,
        tuple(complex(m) for m in cycle.multipliers), how, error, remark, cycle,
    )  # fmt: skip


def signature(cycle: LimitCycle) -> tuple[bool, ...]:
    """For every contact with omega_l = 0, whether the disc sticks there."""
    return tuple(margin >= 0.0 for margin in cycle.hits)


class Segment:
    """The branch between two neighbouring points, as a function of the arclength from `a`."""

    def __init__(self, corrector: Corrector, a: Point, b: Point) -> None:
        self.corrector, self.a, self.b = corrector, a, b
        self.length = b.arclength - a.arclength
        chord = (b.z - a.z) / corrector.scale
        self.border = chord / np.linalg.norm(chord)

    def __call__(self, s: float) -> Point:
        """The point at arclength `s` from `a`."""
        if s <= 0.0:
            return self.a
        if s >= self.length:
            return self.b
        # Hermite's cubic through both ends and their tangents: a close first guess.
        r = s / self.length
        ends = (2.0 * r - 3.0) * r * r
        out, into = r * (1.0 - r) ** 2, r * r * (r - 1.0)
        bow = self.length * (out * self.a.tangent + into * self.b.tangent)
        guess = self.a.z + ends * (self.a.z - self.b.z) + self.corrector.scale * bow
        return self.corrector.point(guess, self.border, self.a.arclength + s)


def special_points(corrector: Corrector, a: Point, b: Point) -> Iterator[SpecialPoint]:
    """All special points between two neighbouring points of a branch.

    Raises:
        CycleError: Newton fails on the way.
    """
    segment = Segment(corrector, a, b)
    if a.tangent[-1] * b.tangent[-1] < 0.0:
        yield _fold(segment)
    yield from _contacts(segment, 0.0, a, segment.length, b, _SPLITS)


def solve_on(
    segment: Segment, value: Callable[[Point], float], low: float, high: float
) -> tuple[Point, float]:
    """Root of `value` between two arclengths: the point and the error of its parameter."""
    s = float(brentq(lambda s: value(segment(s)), low, high, xtol=1e-11, rtol=1e-13))
    width = 1e-6 * (high - low)
    near, point = segment(max(s - width, low)), segment(s)
    slope = abs(point.z[-1] - near.z[-1]) / max(width, 1e-300)
    return point, slope * 1e-11 + _FLOOR


def _fold(segment: Segment) -> SpecialPoint:
    point, error = solve_on(segment, lambda p: float(p.tangent[-1]), 0.0, segment.length)
    how = "the branch's tangent has no component along the parameter; a multiplier is 1"
    return cycle_point("fold", point.cycle, how, error)


def _contacts(
    segment: Segment, low: float, a: Point, high: float, b: Point, splits: int
) -> Iterator[SpecialPoint]:
    before, after = signature(a.cycle), signature(b.cycle)
    if before == after:
        return
    short, long = sorted((before, after), key=len)
    switch = [i for i in range(len(short)) if before[i] != after[i]]
    if (short, long) == ((), (True,)):
        yield _grazing(segment, low, a, high)
    elif len(short) == len(long) and len(switch) == 1:
        yield _switch(segment, low, high, switch[0])
    elif short and short[0] and long == (False, True, *short[1:]):
        # Pulled through by a hair, the disc comes back at once and sticks then.
        yield _switch(segment, low, high, 0)
    elif splits == 0 and _one_more(short, long):
        error = abs(b.z[-1] - a.z[-1])
        yield cycle_point("grazing", a.cycle, "a further contact begins, by bisection", error)
    elif splits == 0:
        raise CycleError(
            f"contacts change from {before} to {after} at parameter {a.z[-1]:.9g} in one place"
        )
    else:
        middle = 0.5 * (low + high)
        point = segment(middle)
        yield from _contacts(segment, low, a, middle, point, splits - 1)
        yield from _contacts(segment, middle, point, high, b, splits - 1)


def _one_more(short: tuple[bool, ...], long: tuple[bool, ...]) -> bool:
    """Whether the longer sequence has one more contact, at which the disc sticks."""
    places = (i for i, sticks in enumerate(long) if sticks)
    return any(long[:i] + long[i + 1 :] == short for i in places)


def _switch(segment: Segment, low: float, high: float, hit: int) -> SpecialPoint:
    """Where the stiction margin of contact `hit` changes sign."""

    def margin(point: Point) -> float:
        if len(point.cycle.hits) <= hit:
            raise CycleError(f"contact {hit + 1} is lost near parameter {point.z[-1]:.9g}")
        return point.cycle.hits[hit]

    point, error = solve_on(segment, margin, low, high)
    how = f"ktheta |twist| = Tsl at contact {hit + 1}"
    return cycle_point("reversal" if hit == 0 else "last stick", point.cycle, how, error)


def _grazing(segment: Segment, low: float, a: Point, high: float) -> SpecialPoint:
    """Where min omega_l reaches zero, approached from the side without contact.

    On that side the minimum is smooth; on the other it is exactly zero.
    """
    free, touching = (low, high) if not a.cycle.hits else (high, low)
    here = segment(free)
    # A second point without contact, as close as it must be for the first secant.
    for k in range(1, 40):
        other = free + (touching - free) * 0.5**k
        there = segment(other)
        if not there.cycle.hits:
            break
    else:
        return cycle_point(
            "grazing", here.cycle, "min omega_l = 0 at a point of the branch", _FLOOR
        )
    slope = 1.0
    for _ in range(60):
        slope = (there.cycle.min - here.cycle.min) / (other - free)
        if slope == 0.0:
            raise CycleError(f"min omega_l does not move towards 0 near {there.z[-1]:.9g}")
        root = other - there.cycle.min / slope
        s = other + (1.0 - 1e-4) * (root - other)
        if there.cycle.min < 1e-12 or abs(s - other) < 1e-14 * segment.length:
            break
        point = segment(s)
        if point.cycle.hits:
            touching = s
            s = 0.5 * (other + s)
            point = segment(s)
            if point.cycle.hits:
                break
        free, here, other, there = other, there, s, point
    left = abs(there.cycle.min / slope) * abs(there.z[-1] - here.z[-1]) / abs(other - free)
    return cycle_point("grazing", there.cycle, "min omega_l = 0", left + _FLOOR)
