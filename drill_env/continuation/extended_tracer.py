"""Branches of limit cycles of a rig with effects over the voltage, stable and unstable."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.continuation.along_branch import ended, known, typical_sizes
from drill_env.continuation.branch import Corrector, Point, StepRule, at_edge, follow, oriented
from drill_env.continuation.crossings import crossings
from drill_env.continuation.extended_cycle import extended_cycle
from drill_env.continuation.extended_flow import ExtendedFlow
from drill_env.continuation.flow import CycleError
from drill_env.continuation.special import Segment, SpecialPoint, special_points
from drill_env.continuation.tracer import CycleBranch, Progress
from drill_env.parameters import Rig

# A bound on the work; a branch that meets it says so.
_MAX_POINTS = 1000
_RULE = StepRule(first=0.02, largest=0.2, turn=0.5)


@dataclass(eq=False)
class ExtendedTracer:
    """Collects branches of cycles that pass through what the rig settles on.

    Attributes:
        rig: parameters and lasting effects, none of which follows time or an angle.
        low: end of the range, V.
        high: other end of the range, V.
        progress: called with the number of cycles so far.
        rule: step lengths.
        branches: found so far.
        points: special points on them.
        failures: what could not be followed, and why.
    """

    rig: Rig
    low: float
    high: float
    progress: Progress | None = None
    rule: StepRule = _RULE
    branches: list[CycleBranch] = field(default_factory=list)
    points: list[SpecialPoint] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)

    def through(self, volts: float, state: FloatArray | None = None) -> None:
        """Follow the cycle next to what the rig does from a state, to both sides.

        Args:
            volts: where it vibrates, V.
            state: twist, omega_u, omega_l, theta_l, shape (4,); rest by default.
        """
        try:
            cycle = extended_cycle(self.rig, volts, state)
        except (InputError, RuntimeError) as error:
            self.failures.append(f"cycle at {volts:.6g} V: {error}")
            return
        z = np.append(cycle.start, [cycle.period, volts])
        if known(self.branches, z):
            return
        for side in (1.0, -1.0):
            self._trace(z, side)

    def _trace(self, z: FloatArray, side: float) -> None:
        corrector, axis = Corrector(ExtendedFlow(self.rig), typical_sizes(z), 1e-9), np.eye(len(z))
        start, points = f"stable cycle found by simulation at {z[-1]:.6g} V", []
        try:
            first = corrector.point(z, axis[-1], 0.0)
            points.append(oriented(first, side * axis[-1]))
            end = self._walk(corrector, points)
        except CycleError as error:
            end = str(error)
            self.failures.append(f"cycles from the {start}: {end}")
        if len(points) > 1:
            self.branches.append(CycleBranch(tuple(points), start, end))

    def _walk(self, corrector: Corrector, points: list[Point]) -> str:
        """Append points until something ends the branch; returns what."""
        for point in follow(corrector, points[0], self.rule):
            here = points[-1]
            if reason := ended(point, self.low, self.high):
                last = at_edge(corrector, here, point, (self.low, self.high))
                points += [] if last is None else [last]
                return reason
            self._note(corrector, here, point)
            points.append(point)
            if self.progress is not None:
                self.progress(len(points) + sum(len(b.points) for b in self.branches))
            if len(points) >= _MAX_POINTS:
                break
        return f"{_MAX_POINTS} points"

    def _note(self, corrector: Corrector, a: Point, b: Point) -> None:
        try:
            self.points += [_as_told(point) for point in special_points(corrector, a, b)]
            self.points += crossings(Segment(corrector, a, b))
        except CycleError as error:
            self.failures.append(f"special points between {a.z[-1]:.9g} and {b.z[-1]:.9g}: {error}")


def _as_told(point: SpecialPoint) -> SpecialPoint:
    """With effects no formula gives the margin at a contact: how it ends tells."""
    if point.kind in ("reversal", "last stick"):
        return dataclasses.replace(point, how="a contact of the lower disc begins or ends to stick")
    return point


def vibrating(volts: FloatArray, cycles: list[bool]) -> Iterator[float]:
    """The middle voltage of every stretch of a sweep on which the rig vibrates."""
    stretch: list[float] = []
    for value, cycle in zip([*volts.tolist(), 0.0], [*cycles, False], strict=True):
        if cycle:
            stretch.append(value)
        elif stretch:
            yield stretch[len(stretch) // 2]
            stretch = []
