"""Where a multiplier crosses the unit circle along a branch."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from drill_env.continuation.branch import Point
from drill_env.continuation.flow import CycleError
from drill_env.continuation.special import (
    PointKind,
    Segment,
    SpecialPoint,
    cycle_point,
    solve_on,
)

_SPLITS = 20
_REAL = 1e-6


def unstable_count(point: Point) -> int:
    """Multipliers outside the unit circle."""
    return int((np.abs(point.cycle.multipliers) > 1.0).sum())


def crossings(segment: Segment) -> Iterator[SpecialPoint]:
    """Crossings between both ends of a segment, folds left out.

    Raises:
        CycleError: Newton fails on the way, or crossings cannot be told apart.
    """
    yield from _between(segment, 0.0, segment.a, segment.length, segment.b, _SPLITS)


def _between(
    segment: Segment, low: float, a: Point, high: float, b: Point, splits: int
) -> Iterator[SpecialPoint]:
    before, after = unstable_count(a), unstable_count(b)
    if before == after:
        return
    index = max(before, after) - 1
    if abs(before - after) <= 2:

        def excess(point: Point) -> float:
            return float(np.sort(-np.abs(point.cycle.multipliers))[index] * -1.0 - 1.0)

        point, error = solve_on(segment, excess, low, high)
        crossed = complex(point.cycle.multipliers[np.abs(_excesses(point)).argmin()])
        pair = abs(crossed.imag) > _REAL
        if pair == (abs(before - after) == 2):
            yield from _named(segment, point, crossed, error)
            return
    if splits == 0:
        raise CycleError(f"several multipliers cross at once near parameter {a.z[-1]:.9g}")
    middle = 0.5 * (low + high)
    half = segment(middle)
    yield from _between(segment, low, a, middle, half, splits - 1)
    yield from _between(segment, middle, half, high, b, splits - 1)


def _excesses(point: Point) -> np.ndarray:
    return np.abs(point.cycle.multipliers) - 1.0


def _named(
    segment: Segment, point: Point, crossed: complex, error: float
) -> Iterator[SpecialPoint]:
    kind: PointKind = "neimark-sacker"
    how = "a pair of multipliers has size 1"
    if abs(crossed.imag) <= _REAL:
        if segment.a.tangent[-1] * segment.b.tangent[-1] < 0.0:
            # The fold, which `special_points` locates by the tangent.
            return
        kind = "period doubling" if crossed.real < 0.0 else "real crossing"
        how = f"a multiplier is {np.sign(crossed.real):.0f}"
    yield cycle_point(kind, point.cycle, how, error)
