"""Equilibria of a sampled loop over the set point, and where they change stability."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np

from drill_env.continuation.branch import Corrector, Point, StepRule, at_edge, follow, oriented
from drill_env.continuation.crossings import crossings
from drill_env.continuation.flow import CycleError
from drill_env.continuation.loop_flow import LoopMotion, LoopRest
from drill_env.continuation.loop_period import SampledLoop
from drill_env.continuation.special import Segment, SpecialPoint, special_points
from drill_env.continuation.tracer import CycleBranch

_TRIES = 6
_MAX_POINTS = 3000
_AT_LIMIT = 0.999


def motion_of(point: Point) -> LoopMotion:
    """The loop's motion at a point of its branch."""
    assert isinstance(point.cycle, LoopMotion)
    return point.cycle


def equilibrium_at(loop: SampledLoop, setpoint: float) -> tuple[Corrector, Point]:
    """The loop's equilibrium at one set point (rad/s), and the Newton's method that found it.

    Raises:
        CycleError: Newton's method does not converge from the steady state there.
    """
    guess = np.append(loop.steady(setpoint), [loop.config.control_period, setpoint])
    scale = 1.0 + np.abs(guess)
    scale[-2:] = loop.config.control_period, 1.0
    corrector = Corrector(LoopRest(loop), scale, loop.tolerance)
    return corrector, corrector.at_parameter(guess, setpoint)


class EquilibriumTracer:
    """The branch of equilibria between two set points.

    Args:
        loop: the sampled loop.
        low: smallest set point, rad/s.
        high: largest set point, rad/s.
        rule: step lengths.
    """

    def __init__(self, loop: SampledLoop, low: float, high: float, rule: StepRule) -> None:
        self._loop, self._low, self._high, self._rule = loop, low, high, rule
        self.points: list[SpecialPoint] = []
        self.failures: list[str] = []

    def branch(self) -> CycleBranch:
        """Equilibria from the lowest set point on that has one; special points are kept."""
        for setpoint in np.linspace(self._low, self._high, _TRIES).tolist():
            try:
                corrector, start = equilibrium_at(self._loop, setpoint)
            except CycleError as error:
                self.failures.append(f"equilibrium at set point {setpoint:.6g}: {error}")
                continue
            up, end = self._walk(corrector, start, 1.0)
            down, begin = [start], f"left the range at {self._low:.6g}"
            if setpoint > self._low:
                down, begin = self._walk(corrector, start, -1.0)
            return CycleBranch((*reversed(down[1:]), *up), begin, end)
        return CycleBranch((), "", "no equilibrium found")

    def _walk(self, corrector: Corrector, start: Point, side: float) -> tuple[list[Point], str]:
        """Points from `start` towards larger or smaller set points, and what ended them."""
        points = [oriented(start, side * np.eye(len(start.z))[-1])]
        try:
            for point in follow(corrector, points[0], self._rule):
                if reason := self._ended(motion_of(point)):
                    last = at_edge(corrector, points[-1], point, (self._low, self._high))
                    return points if last is None else [*points, last], reason
                self.points += self._special(corrector, points[-1], point)
                points.append(point)
                if len(points) >= _MAX_POINTS:
                    break
        except CycleError as error:
            return points, str(error)
        return points, f"{_MAX_POINTS} points"

    def _ended(self, motion: LoopMotion) -> str:
        if not self._low <= motion.parameter <= self._high:
            edge = self._low if motion.parameter < self._low else self._high
            return f"left the range at {edge:.6g}"
        if abs(motion.volts[1]) > _AT_LIMIT * self._loop.config.voltage_limit:
            return f"the voltage limit is reached at {motion.parameter:.6g}"
        return "" if motion.max > 0.0 else f"the discs stop at {motion.parameter:.6g}"

    def _special(self, corrector: Corrector, a: Point, b: Point) -> Iterator[SpecialPoint]:
        segment = Segment(corrector, a, b)
        try:
            for found in (*special_points(corrector, a, b), *crossings(segment)):
                motion = found.cycle
                assert isinstance(motion, LoopMotion)
                angle = max(abs(float(np.angle(m))) for m in motion.multipliers[:2])
                period = 2.0 * np.pi * motion.clock / angle if angle > 0.0 else float("nan")
                yield dataclasses.replace(found, omega=motion.max, period=period)
        except CycleError as error:
            self.failures.append(f"special points near {a.z[-1]:.9g}: {error}")
