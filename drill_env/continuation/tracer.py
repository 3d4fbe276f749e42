"""Branches of limit cycles from all their possible beginnings."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from drill_env._types import FloatArray
from drill_env.continuation.branch import Corrector, Point, StepRule, follow, oriented
from drill_env.continuation.cycle import CycleError, PeriodMap
from drill_env.continuation.hopf import HopfPoint
from drill_env.continuation.special import SpecialPoint, cycle_point, special_points
from drill_env.integrator import Disc, Kind, NegativeFrictionWarning, simulate
from drill_env.parameters import Rig

_MAX_POINTS = 3000
# Cycles smaller than this share of their speed have shrunk to the equilibrium.
VANISHED = 4e-3

Progress = Callable[[int], None]


@dataclass(frozen=True, slots=True)
class CycleBranch:
    """Limit cycles along one branch.

    Attributes:
        points: in order of arclength.
        start: what it grew from.
        end: why it stops.
    """

    points: tuple[Point, ...]
    start: str
    end: str


class Tracer:
    """Collects branches of cycles from all their possible beginnings.

    Args:
        flow: period map of the continued parameter.
        low: end of the range.
        high: other end of the range.
        hopf: Hopf points of the voltage, where branches start or end.
        rule: step lengths.
        progress: called with the number of cycles so far.
    """

    def __init__(
        self,
        flow: PeriodMap,
        low: float,
        high: float,
        hopf: tuple[HopfPoint, ...] = (),
        rule: StepRule | None = None,
        progress: Progress | None = None,
    ) -> None:
        self._flow, self._low, self._high, self._hopf = flow, low, high, hopf
        self.rule, self.progress = rule or StepRule(), progress
        self.branches: list[CycleBranch] = []
        self.points: list[SpecialPoint] = []
        self.failures: list[str] = []
        self._reached: set[int] = set()

    def from_hopf_points(self) -> None:
        """Branches born at the Hopf points; one that ends at another takes that one too."""
        for i, point in enumerate(self._hopf):
            if i in self._reached:
                continue
            self._reached.add(i)
            amplitude = float(np.clip(0.02 * point.omega, 1e-3, 0.05))
            state = point.state + amplitude * point.mode.real
            guess = np.append(state, [2.0 * np.pi / point.frequency, point.voltage])
            self._trace(guess, f"Hopf point at {point.voltage:.6g} V", np.eye(5)[2])

    def from_simulation(self) -> None:
        """Branches that grow from no Hopf point: the rig is left to settle and followed."""
        for value in np.linspace(self._low, self._high, 8)[1:-1]:
            guess = settled_cycle(self._flow, float(value))
            if guess is None or self._known(guess):
                continue
            for side in (1.0, -1.0):
                start = f"stable cycle found by simulation at {value:.6g}"
                self._trace(guess, start, side * np.eye(5)[4], fixed=True)

    def _known(self, guess: FloatArray) -> bool:
        volts, peak = guess[4], guess[2]
        for branch in self.branches:
            z = np.array([p.z for p in branch.points])
            near = np.flatnonzero((z[:-1, 4] - volts) * (z[1:, 4] - volts) <= 0.0)
            for i in near.tolist():
                span = z[i + 1, 4] - z[i, 4]
                share = (volts - z[i, 4]) / span if span else 0.0
                if abs(z[i, 2] + share * (z[i + 1, 2] - z[i, 2]) - peak) < 0.02 * (1.0 + peak):
                    return True
        return False

    def _trace(
        self, guess: FloatArray, start: str, direction: FloatArray, fixed: bool = False
    ) -> None:
        size = max(1.0, float(guess[2]))
        span = min(1.0, self._high - self._low)
        scale = np.array([0.5 * size + 1.0, size + 4.0, size + 9.0, guess[3], span])
        corrector = Corrector(self._flow, scale)
        points: list[Point] = []
        try:
            border = np.eye(5)[4] if fixed else direction
            points.append(oriented(corrector.point(guess, border, 0.0), direction))
            end = self._walk(corrector, points)
        except CycleError as error:
            end = str(error)
            if points and _grazes(points[-1], self._flow.rig_at(float(points[-1].z[4]))):
                end = self._corner(points[-1])
            else:
                self.failures.append(f"cycles from the {start}: {end}")
        if len(points) > 1:
            self.branches.append(CycleBranch(tuple(points), start, end))

    def _walk(self, corrector: Corrector, points: list[Point]) -> str:
        """Append points until something ends the branch; returns what."""
        done = sum(len(branch.points) for branch in self.branches)
        for point in follow(corrector, points[0], self.rule):
            reason = self._ended(point)
            if reason:
                return reason
            self._note_special_points(corrector, points[-1], point)
            points.append(point)
            if self.progress is not None:
                self.progress(done + len(points))
            if len(points) >= _MAX_POINTS:
                break
        return f"{_MAX_POINTS} points"

    def _corner(self, last: Point) -> str:
        """Log the non-smooth fold in which a branch ends; returns what ended it."""
        value = float(last.z[4])
        known = [p.parameter for p in self.points if p.kind == "non-smooth fold"]
        if not any(abs(value - other) < 1e-5 * (1.0 + abs(value)) for other in known):
            how = "the smallest step fails at a graze: min omega_l = 0 or the margin is used up"
            point = cycle_point("non-smooth fold", last.cycle, how, 1e-6 * (1.0 + abs(value)))
            self.points.append(point)
        return f"non-smooth fold at {value:.7g}"

    def _note_special_points(self, corrector: Corrector, a: Point, b: Point) -> None:
        try:
            self.points += special_points(corrector, a, b)
        except CycleError as error:
            where = f"between {a.z[4]:.9g} and {b.z[4]:.9g}"
            self.failures.append(f"special points {where}: {error}")

    def _ended(self, point: Point) -> str:
        value, cycle = float(point.z[4]), point.cycle
        if not self._low <= value <= self._high:
            return f"left the range at {value:.6g}"
        if cycle.max - cycle.min > VANISHED * max(abs(cycle.max), 0.1):
            return ""
        near = [i for i, h in enumerate(self._hopf) if abs(h.voltage - value) < 0.02 * h.voltage]
        self._reached.update(near)
        if near:
            return f"shrank into the Hopf point at {self._hopf[near[0]].voltage:.6g} V"
        return f"shrank to an equilibrium at {value:.6g}"


def _grazes(point: Point, rig: Rig) -> bool:
    """Whether the cycle barely misses, or barely keeps, its contact with omega_l = 0."""
    cycle = point.cycle
    if not cycle.hits:
        return 0.0 <= cycle.min < 1e-5 * cycle.max
    return len(cycle.hits) == 1 and 0.0 <= cycle.hits[0] < 1e-2 * rig.Tsl


def settled_cycle(flow: PeriodMap, value: float) -> FloatArray | None:
    """The cycle the rig settles on from rest, as a first guess (5,), or None if it is steady."""
    rig, volts = flow.rig_at(value), flow.voltage_at(value)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NegativeFrictionWarning)
        periods = 60.0 * rig.natural_period
        settled = simulate(rig, volts, periods, t_eval=np.zeros(0), rtol=1e-8)
        end = simulate(
            rig, volts, 6.0 * rig.natural_period, t_eval=np.zeros(0), extrema=True, rtol=1e-9,
            initial=settled.final_state, modes=settled.final_modes,
        )  # fmt: skip
    peaks = end.events.where(Disc.LOWER, Kind.MAXIMUM)
    if len(peaks) < 2:
        return None
    lows = end.events.where(Disc.LOWER).state[:, 2]
    highest = np.flatnonzero(peaks.state[:, 2] > peaks.state[:, 2].max() - 1e-3)
    top = float(peaks.state[:, 2].max())
    if len(highest) < 2 or top - lows.min() < 1e-2 * (1.0 + top):
        return None
    i, j = highest[-2:]
    period = float(peaks.t[j] - peaks.t[i])
    return np.concatenate([peaks.state[j, :3], [period, value]])
