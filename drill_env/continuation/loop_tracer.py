"""Branches of limit cycles of a sampled loop over the set point."""

from __future__ import annotations

import dataclasses

import numpy as np

from drill_env._types import FloatArray
from drill_env.continuation.along_branch import ended, known, typical_sizes
from drill_env.continuation.branch import Corrector, Point, StepRule, at_edge, follow, oriented
from drill_env.continuation.crossings import crossings
from drill_env.continuation.flow import CycleError
from drill_env.continuation.hopf import eigenpairs
from drill_env.continuation.loop_clock import OwnClock
from drill_env.continuation.loop_equilibria import motion_of
from drill_env.continuation.loop_flow import LoopRest
from drill_env.continuation.loop_period import SampledLoop
from drill_env.continuation.loop_settle import settled_motion
from drill_env.continuation.special import Segment, SpecialPoint, special_points
from drill_env.continuation.tracer import CycleBranch, Progress

_MAX_POINTS = 2000
# A cycle changes to the next number of control periods past the middle between both.
_SWITCH = 0.6


class LoopTracer:
    """Collects branches of cycles from their births and from what the loop settles on.

    Args:
        loop: the sampled loop.
        low: smallest set point, rad/s.
        high: largest set point, rad/s.
        rule: step lengths.
        progress: called with the number of cycles so far.
    """

    def __init__(
        self, loop: SampledLoop, low: float, high: float, rule: StepRule,
        progress: Progress | None = None,
    ) -> None:  # fmt: skip
        self._loop, self._low, self._high, self._rule = loop, low, high, rule
        self._progress = progress
        self.branches: list[CycleBranch] = []
        self.points: list[SpecialPoint] = []
        self.failures: list[str] = []

    def from_births(self, births: list[SpecialPoint]) -> None:
        """Branches born at Neimark-Sacker points of the equilibria, each traced once."""
        for birth in births:
            ends = [_last(branch) for branch in self.branches if "shrank" in branch.end]
            reach = 0.01 * (1.0 + birth.parameter)
            if not any(abs(end - birth.parameter) < reach for end in ends):
                self._from_birth(birth)

    def _from_birth(self, birth: SpecialPoint) -> None:
        state, mode, along = self._critical_mode(birth)
        size = float(np.clip(0.02 * birth.omega, 1e-3, 0.05))
        z = np.append(state + size * mode, [birth.period, birth.parameter])
        clock = OwnClock(self._loop, typical_sizes(z))
        tangent = along / typical_sizes(z)
        tangent /= np.linalg.norm(tangent)
        # Across the equilibria: along them Newton's method could shrink the cycle to a point.
        border = np.eye(len(z))[2]
        border = border - (border @ tangent) * tangent
        start = f"Neimark-Sacker point at {birth.parameter:.6g}"
        self._trace(clock, z, border, border, start)

    def _critical_mode(self, birth: SpecialPoint) -> tuple[FloatArray, FloatArray, FloatArray]:
        """State, real part of the critical mode (omega_l: 1), and the equilibria's direction."""
        assert birth.cycle is not None
        state, period = birth.cycle.state, self._loop.config.control_period
        jacobian = LoopRest(self._loop).shoot(state, period, birth.parameter).jacobian
        values, vectors = eigenpairs(jacobian[:, :-2])
        i = int(np.argmin(np.abs(np.abs(values) - 1.0) + 10.0 * (values.imag <= 0.0)))
        mode = np.asarray((vectors[:, i] / vectors[2, i]).real)
        drift = np.linalg.solve(np.eye(len(state)) - jacobian[:, :-2], jacobian[:, -1])
        return state, mode, np.append(drift, [0.0, 1.0])

    def from_simulation(self, starts: int) -> None:
        """Branches that are born at no equilibrium: the loop settles from large motions."""
        for setpoint in np.linspace(self._low, self._high, starts + 2)[1:-1].tolist():
            try:
                z = settled_motion(self._loop, setpoint)
            except CycleError as error:
                self.failures.append(f"simulation at set point {setpoint:.6g}: {error}")
                continue
            if z is None or known(self.branches, z):
                continue
            clock = OwnClock(self._loop, typical_sizes(z))
            axis = np.eye(len(z))[-1]
            for side in (1.0, -1.0):
                start = f"stable cycle found by simulation at {setpoint:.6g}"
                self._trace(clock, z, axis, side * axis, start)

    def _trace(
        self, clock: OwnClock, z: FloatArray, border: FloatArray, way: FloatArray, start: str
    ) -> None:
        beats = max(1, round(float(z[-2]) / self._loop.config.control_period))
        points: list[Point] = []
        try:
            corrector = clock.corrector(beats)
            points.append(oriented(corrector.point(z, border, 0.0), way))
            end = self._walk(clock, corrector, points)
        except CycleError as error:
            end = str(error)
            if points and motion_of(points[-1]).saturates(self._loop.config.voltage_limit):
                end = f"the voltage limit is reached within the cycle at {points[-1].z[-1]:.6g}"
            else:
                self.failures.append(f"cycles from the {start}: {end}")
        if len(points) > 1:
            self.branches.append(CycleBranch(tuple(clock.own(p) for p in points), start, end))

    def _walk(self, clock: OwnClock, corrector: Corrector, points: list[Point]) -> str:
        """Append points until something ends the branch; returns what."""
        rule, period = self._rule, self._loop.config.control_period
        here, step = points[-1], rule.first
        while len(points) < _MAX_POINTS:
            for point in follow(corrector, here, dataclasses.replace(rule, first=step)):
                if reason := ended(point, self._low, self._high):
                    last = at_edge(corrector, here, point, (self._low, self._high))
                    points += [] if last is None else [last]
                    return reason
                self._note(clock, corrector, here, point)
                points.append(point)
                step, here = min(rule.largest, point.arclength - here.arclength), point
                if self._progress is not None:
                    self._progress(len(points) + sum(len(b.points) for b in self.branches))
                beats = float(point.z[-2]) / period
                if abs(beats - motion_of(point).beats) > _SWITCH or len(points) >= _MAX_POINTS:
                    break
            corrector = clock.corrector(round(float(here.z[-2]) / period))
            same = corrector.point(here.z, here.tangent, here.arclength)
            here = points[-1] = oriented(same, here.tangent)
        return f"{_MAX_POINTS} points"

    def _note(self, clock: OwnClock, corrector: Corrector, a: Point, b: Point) -> None:
        try:
            self.points += [clock.special(a, b, p) for p in special_points(corrector, a, b)]
            self.points += crossings(Segment(corrector, a, b))
        except CycleError as error:
            self.failures.append(f"special points between {a.z[-1]:.9g} and {b.z[-1]:.9g}: {error}")


def _last(branch: CycleBranch) -> float:
    return branch.points[-1].cycle.parameter
