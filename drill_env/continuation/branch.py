"""Pseudo-arclength continuation of limit cycles."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from drill_env._types import FloatArray
from drill_env.continuation.flow import CycleError, Flow, LimitCycle, Shot

# Newton's last step may be so many times the tolerance.
_LAST_MOVE = 10.0
_NEWTON_LIMIT = 8


@dataclass(frozen=True, slots=True)
class Point:
    """A cycle on a branch, with what the next step needs.

    Attributes:
        z: (twist, omega_u, omega_l, ..., period, parameter), shape (n,).
        tangent: unit direction of the branch in scaled variables, shape (n,).
        arclength: along the branch from its start.
        cycle: the limit cycle.
    """

    z: FloatArray
    tangent: FloatArray
    arclength: float
    cycle: LimitCycle


@dataclass(frozen=True, slots=True)
class StepRule:
    """Lengths of the steps along a branch, in scaled variables.

    Attributes:
        first: first step.
        smallest: below it the continuation fails.
        largest: upper bound.
        turn: largest angle between tangents, rad.
    """

    first: float = 0.01
    smallest: float = 1e-7
    largest: float = 0.12
    turn: float = 0.3


class Corrector:
    """Newton's method for closed cycles on a hyperplane.

    Args:
        flow: the period map.
        scale: typical sizes of (twist, omega_u, omega_l, ..., period, parameter), shape (n,).
        tolerance: relative gap below which a cycle is closed.
    """

    def __init__(self, flow: Flow, scale: FloatArray, tolerance: float = 1e-10) -> None:
        self.flow, self.scale, self._tolerance = flow, scale, tolerance
        self._axes = np.eye(len(scale))

    def equations(self, z: FloatArray) -> tuple[FloatArray, FloatArray, Shot]:
        """Closure and section condition, shape (n - 1,), and their scaled Jacobian, (n - 1, n)."""
        state = z[:-2]
        shot = self.flow.shoot(state, float(z[-2]), float(z[-1]))
        condition, gradient = self.flow.phase(state, float(z[-1]))
        value, matrix = np.empty(len(z) - 1), np.empty((len(z) - 1, len(z)))
        value[:-1], value[-1] = shot.end - state, condition
        matrix[:-1] = shot.jacobian - self._axes[:-2]
        matrix[-1] = gradient
        return value, matrix * self.scale, shot

    def solve(
        self, guess: FloatArray, border: FloatArray
    ) -> tuple[FloatArray, FloatArray, Shot, int]:
        """Closest cycle in the hyperplane through `guess` normal to `border` (scaled).

        Returns:
            The cycle's z, the tangent there, its shot and the Newton steps taken.

        Raises:
            CycleError: Newton does not converge.
        """
        z = guess.copy()
        for step in range(_NEWTON_LIMIT):
            value, matrix, shot = self.equations(z)
            full = np.vstack([matrix, border])
            right = np.append(-value, border @ ((guess - z) / self.scale))
            try:
                move = np.linalg.solve(full, right)
            except np.linalg.LinAlgError as error:
                raise CycleError(f"singular Newton matrix at parameter {z[-1]:.9g}") from error
            size = float(np.abs(move).max())
            closes = np.abs(value).max() < self._tolerance * (1.0 + np.abs(z[:-2]).max())
            # Where a multiplier is near 1 a small gap still means a cycle far away.
            if closes and size < _LAST_MOVE * self._tolerance:
                return z, self.tangent(matrix, border), shot, step
            if not np.isfinite(size) or size > 2.0:
                raise CycleError(f"Newton's step {step + 1} runs away at parameter {z[-1]:.9g}")
            z = z + self.scale * move
        raise CycleError(
            f"no convergence in {_NEWTON_LIMIT} Newton steps near parameter {z[-1]:.9g}"
        )

    def tangent(self, matrix: FloatArray, along: FloatArray) -> FloatArray:
        """Unit null vector of the Jacobian, on the side of `along`."""
        vector = np.linalg.solve(np.vstack([matrix, along]), self._axes[-1])
        return vector / np.linalg.norm(vector)

    def point(self, guess: FloatArray, border: FloatArray, arclength: float) -> Point:
        """A corrected point of the branch."""
        z, tangent, shot, steps = self.solve(guess, border)
        return Point(z, tangent, arclength, self.flow.describe(shot, z, steps))

    def at_parameter(self, guess: FloatArray, value: float) -> Point:
        """The cycle at a fixed value of the parameter, from a nearby guess."""
        start = guess.copy()
        start[-1] = value
        return self.point(start, self._axes[-1], 0.0)


def oriented(point: Point, direction: FloatArray) -> Point:
    """The same point with its tangent on the side of `direction` (scaled, shape (n,))."""
    if point.tangent @ direction >= 0.0:
        return point
    return dataclasses.replace(point, tangent=-point.tangent)


def at_edge(corrector: Corrector, a: Point, b: Point, edges: Iterable[float]) -> Point | None:
    """The point between two neighbours at the first of `edges` they lie on both sides of.

    None if there is no such edge or Newton's method fails.
    """
    for edge in edges:
        if (a.z[-1] - edge) * (b.z[-1] - edge) >= 0.0:
            continue
        share = (edge - a.z[-1]) / (b.z[-1] - a.z[-1])
        try:
            found = corrector.at_parameter(a.z + share * (b.z - a.z), edge)
        except CycleError:
            return None
        arclength = a.arclength + share * (b.arclength - a.arclength)
        return oriented(dataclasses.replace(found, arclength=arclength), a.tangent)
    return None


def follow(corrector: Corrector, start: Point, rule: StepRule) -> Iterator[Point]:
    """Points of the branch from `start` on, along its tangent, for as long as they are asked for.

    Raises:
        CycleError: even the smallest step does not converge.
    """
    step, here = rule.first, start
    bend = np.zeros(len(start.z))
    while True:
        try:
            there = _next(corrector, here, step, bend, rule)
        except CycleError as error:
            step *= 0.5
            if step >= rule.smallest:
                continue
            there = _past_corner(corrector, here, error)
            step = rule.first
        yield there
        bend = (there.tangent - here.tangent) / (there.arclength - here.arclength)
        here = there
        step = min(rule.largest, step * (1.4 if here.cycle.steps <= 3 else 0.9))


def _next(
    corrector: Corrector, here: Point, step: float, bend: FloatArray, rule: StepRule
) -> Point:
    # A parabola rather than the tangent: it saves about one Newton step in two.
    ahead = step * here.tangent + 0.5 * step * step * bend
    guess = here.z + corrector.scale * ahead
    there = corrector.point(guess, here.tangent, here.arclength + step)
    turn = float(np.arccos(np.clip(there.tangent @ here.tangent, -1.0, 1.0)))
    if turn > rule.turn:
        raise CycleError(f"the branch turns by {turn:.2f} rad")
    return there


def _past_corner(corrector: Corrector, here: Point, failure: CycleError) -> Point:
    """The branch beyond a corner, where a graze makes it turn at once.

    The amplitude still grows or falls there while the parameter turns back.
    """
    border = np.eye(len(here.z))[2] * (1.0 if here.tangent[2] >= 0.0 else -1.0)
    for size in (1e-4, 1e-3, 1e-2):
        guess = here.z + size * corrector.scale * border
        try:
            return oriented(corrector.point(guess, border, here.arclength + size), border)
        except CycleError:
            continue
    raise CycleError(
        f"continuation stuck at parameter {here.z[-1]:.9g}, arclength {here.arclength:.6g}: "
        f"{failure}"
    ) from failure
