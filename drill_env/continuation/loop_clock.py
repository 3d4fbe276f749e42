"""From cycles of a stretched clock to those of the loop's own."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from drill_env._types import FloatArray
from drill_env.continuation.branch import Corrector, Point
from drill_env.continuation.flow import CycleError
from drill_env.continuation.loop_equilibria import motion_of
from drill_env.continuation.loop_flow import LoopMap, LoopMotion
from drill_env.continuation.loop_period import SampledLoop
from drill_env.continuation.special import SpecialPoint, special_points

_CONTINUOUS = ("parameter", "period", "min", "max", "sticking_s", "reversed_s")


class OwnClock:
    """Interpolates between cycles of neighbouring whole numbers of control periods.

    A cycle that lasts 82.4 control periods is no periodic motion of the sampled loop but a
    torus. With its clock stretched by half a percent it lasts 82 of them, and 83 with the clock
    shortened; between both clocks lies the loop's own.

    Args:
        loop: the sampled loop.
        scale: of the correctors, shape (n + 2,).
    """

    def __init__(self, loop: SampledLoop, scale: FloatArray) -> None:
        self._loop, self._scale = loop, scale
        self._period = loop.config.control_period

    def corrector(self, beats: int) -> Corrector:
        """Newton's method for cycles of so many control periods."""
        return Corrector(LoopMap(self._loop, beats), self._scale, self._loop.tolerance)

    def neighbour(self, point: Point, more: int) -> Point:
        """The cycle of `more` control periods more, in the hyperplane of `point`."""
        corrector = self.corrector(motion_of(point).beats + more)
        return corrector.point(point.z, point.tangent, point.arclength)

    def own(self, point: Point) -> Point:
        """`point` with what it is at the loop's own clock, by linear interpolation.

        Where the neighbour cannot be computed the stretched clock's cycle is kept, and its
        `clock` says so.
        """
        here = motion_of(point)
        try:
            near = self.neighbour(point, 1 if here.clock > self._period else -1)
        except CycleError:
            return point
        there = motion_of(near)
        shares = lagrange([here.clock, there.clock], self._period)
        return dataclasses.replace(point, cycle=self._mixed(here, [here, there], shares))

    def _mixed(
        self, base: LoopMotion, motions: Sequence[LoopMotion], shares: FloatArray
    ) -> LoopMotion:
        def mean(values: Sequence[float]) -> float:
            return float(shares @ np.array(values))

        plain = {name: mean([getattr(m, name) for m in motions]) for name in _CONTINUOUS}
        low, middle, high = (mean([m.volts[k] for m in motions]) for k in range(3))
        return dataclasses.replace(base, **plain, volts=(low, middle, high), clock=self._period)

    def special(self, a: Point, b: Point, found: SpecialPoint) -> SpecialPoint:
        """A special point between `a` and `b` at the loop's own clock.

        It is located on three clocks and interpolated by a parabola; the error takes in by
        how much that differs from the line through the nearest two.
        """
        here = found.cycle
        assert isinstance(here, LoopMotion)
        motions, errors = [here], [found.error]
        order = (1, -1) if here.clock > self._period else (-1, 1)
        for more in order:
            same = self._again(a, b, found, more)
            if same is None:
                # So far the clock is off; what follows from it is at most of that order.
                off = abs(here.clock / self._period - 1.0) * abs(found.parameter)
                return dataclasses.replace(found, error=found.error + off)
            assert isinstance(same.cycle, LoopMotion)
            motions.append(same.cycle)
            errors.append(same.error)
        clocks = [m.clock for m in motions]
        curved = self._mixed(here, motions, lagrange(clocks, self._period))
        straight = self._mixed(here, motions[:2], lagrange(clocks[:2], self._period))
        return dataclasses.replace(
            found, parameter=curved.parameter, min=curved.min, max=curved.max,
            period=curved.period, cycle=curved,
            error=max(errors) + abs(curved.parameter - straight.parameter),
        )  # fmt: skip

    def _again(self, a: Point, b: Point, found: SpecialPoint, more: int) -> SpecialPoint | None:
        """The same special point on another clock, or None."""
        assert isinstance(found.cycle, LoopMotion)
        corrector = self.corrector(found.cycle.beats + more)
        wide = b.arclength - a.arclength
        try:
            # It may lie a little outside the segment.
            ends = [
                corrector.point(p.z + side * wide * self._scale * p.tangent, p.tangent, arc)
                for p, side, arc in ((a, -1.0, 0.0), (b, 1.0, 3.0 * wide))
            ]
            same = [p for p in special_points(corrector, *ends) if p.kind == found.kind]
        except CycleError:
            return None
        return min(same, key=lambda p: abs(p.parameter - found.parameter), default=None)


def lagrange(nodes: Sequence[float], at: float) -> FloatArray:
    """Weights of the polynomial through `nodes`, evaluated at `at`."""
    weights = [
        np.prod([(at - other) / (node - other) for j, other in enumerate(nodes) if j != i])
        for i, node in enumerate(nodes)
    ]
    return np.array(weights, dtype=np.float64)
