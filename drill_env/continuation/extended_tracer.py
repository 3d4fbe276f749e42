"""Branches of limit cycles of a rig with effects over a parameter, stable and unstable."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.continuation.along_branch import SHRANK, ended, known, typical_sizes
from drill_env.continuation.branch import Corrector, Point, StepRule, at_edge, follow, oriented
from drill_env.continuation.crossings import crossings
from drill_env.continuation.extended_cycle import extended_cycle
from drill_env.continuation.extended_flow import ExtendedFlow
from drill_env.continuation.flow import CycleError
from drill_env.continuation.hopf import HopfPoint
from drill_env.continuation.special import Segment, SpecialPoint, special_points
from drill_env.continuation.tracer import CycleBranch, Progress

# A bound on the work; a branch that meets it says so.
_MAX_POINTS = 1000
_RULE = StepRule(first=0.02, largest=0.2, turn=0.5)
# A branch ends a step before its Hopf point: so near, in shares of the voltage.
_NEAR = 0.02


@dataclass(eq=False)
class ExtendedTracer:
    """Collects branches of cycles that grow from Hopf points or pass through attractors.

    Attributes:
        flow: return map of a rig with lasting effects, none of which follows time or an angle.
        low: end of the range of the parameter.
        high: other end of the range.
        progress: called with the number of cycles so far.
        rule: step lengths.
        branches: found so far.
        points: special points on them.
        failures: what could not be followed, and why.
    """

    flow: ExtendedFlow
    low: float
    high: float
    progress: Progress | None = None
    rule: StepRule = _RULE
    branches: list[CycleBranch] = field(default_factory=list)
    points: list[SpecialPoint] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)

    def from_hopf_points(self, points: Iterable[HopfPoint]) -> None:
        """Branches born at Hopf points, stable or not; one that ends at another takes that too."""
        for point in points:
            if self._reached(point):
                continue
            amplitude = float(np.clip(0.02 * point.omega, 1e-3, 0.05))
            state = point.state + amplitude * point.mode.real
            z = np.append(state, [2.0 * np.pi / point.frequency, point.voltage])
            across = np.eye(len(z))[2]
            self._trace(z, across, across, f"Hopf point at {point.voltage:.6g} V")

    def from_simulation(self) -> None:
        """Branches through what the rig settles on from rest, at six values of the range."""
        for value in np.linspace(self.low, self.high, 8)[1:-1].tolist():
            try:
                self._through(value, None)
            except InputError:
                # It rests or turns steadily.
                continue

    def through(self, value: float, state: FloatArray | None = None) -> None:
        """Follow the cycle next to what the rig does from a state, to both sides.

        Args:
            value: of the parameter, at which the rig vibrates.
            state: twist, omega_u, omega_l, theta_l, shape (4,); rest by default.
        """
        try:
            self._through(value, state)
        except InputError as error:
            self.failures.append(f"cycle at {value:.6g}: {error}")

    def _through(self, value: float, state: FloatArray | None) -> None:
        rig, volts = self.flow.rig_at(value), self.flow.voltage_at(value)
        try:
            cycle = extended_cycle(rig, volts, state)
        except RuntimeError as error:
            self.failures.append(f"cycle at {value:.6g}: {error}")
            return
        z = np.append(cycle.start, [cycle.period, value])
        if known(self.branches, z):
            return
        along = np.eye(len(z))[-1]
        for side in (1.0, -1.0):
            start = f"stable cycle found by simulation at {value:.6g}"
            self._trace(z, along, side * along, start)

    def _reached(self, point: HopfPoint) -> bool:
        """Whether a branch has shrunk into a Hopf point."""
        ends = (b.points[-1].cycle.parameter for b in self.branches if b.end.startswith(SHRANK))
        return any(abs(end - point.voltage) < _NEAR * point.voltage for end in ends)

    def _trace(self, z: FloatArray, border: FloatArray, direction: FloatArray, start: str) -> None:
        sizes = typical_sizes(z)
        sizes[-1] = min(1.0, self.high - self.low)
        corrector, points = Corrector(self.flow, sizes, 1e-9), []
        try:
            points.append(oriented(corrector.point(z, border, 0.0), direction))
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
