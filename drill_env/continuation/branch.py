"""Pseudo-arclength continuation of limit cycles."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from drill_env._types import FloatArray
from drill_env.continuation.cycle import CycleError, LimitCycle, PeriodMap, Shot
from drill_env.continuation.describe import describe

_TOLERANCE = 1e-10
_LAST_MOVE = 1e-9
_NEWTON_LIMIT = 8
_IDENTITY = np.eye(3)


@dataclass(frozen=True, slots=True)
class Point:
    """A cycle on a branch, with what the next step needs.

    Attributes:
        z: (twist, omega_u, omega_l, period, parameter), shape (5,).
        tangent: unit direction of the branch in scaled variables, shape (5,).
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
        scale: typical sizes of (twist, omega_u, omega_l, period, parameter), shape (5,).
    """

    def __init__(self, flow: PeriodMap, scale: FloatArray) -> None:
        self.flow, self.scale = flow, scale

    def equations(self, z: FloatArray) -> tuple[FloatArray, FloatArray, Shot]:
        """Closure and section condition, shape (4,), and their scaled Jacobian, (4, 5)."""
        shot = self.flow.shoot(z[:3], z[3], z[4])
        condition, gradient = self.flow.phase(z[:3], z[4])
        value, matrix = np.empty(4), np.empty((4, 5))
        value[:3], value[3] = shot.end - z[:3], condition
        matrix[:3], matrix[3] = shot.jacobian, gradient
        matrix[:3, :3] -= _IDENTITY
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
                raise CycleError(f"singular Newton matrix at parameter {z[4]:.9g}") from error
            size = float(np.abs(move).max())
            closes = np.abs(value).max() < _TOLERANCE * (1.0 + np.abs(z[:3]).max())
            # Where a multiplier is near 1 a small gap still means a cycle far away.
            if closes and size < _LAST_MOVE:
                return z, self.tangent(matrix, border), shot, step
            if not np.isfinite(size) or size > 2.0:
                raise CycleError(f"Newton's step {step + 1} runs away at parameter {z[4]:.9g}")
            z = z + self.scale * move
        raise CycleError(
            f"no convergence in {_NEWTON_LIMIT} Newton steps near parameter {z[4]:.9g}"
        )

    def tangent(self, matrix: FloatArray, along: FloatArray) -> FloatArray:
        """Unit null vector of the Jacobian, on the side of `along`."""
        right = np.zeros(5)
        right[4] = 1.0
        vector = np.linalg.solve(np.vstack([matrix, along]), right)
        return vector / np.linalg.norm(vector)

    def point(self, guess: FloatArray, border: FloatArray, arclength: float) -> Point:
        """A corrected point of the branch."""
        z, tangent, shot, steps = self.solve(guess, border)
        cycle = describe(shot, self.flow.rig_at(z[4]), float(z[4]), z[:3], steps, float(z[3]))
        return Point(z, tangent, arclength, cycle)

    def at_parameter(self, guess: FloatArray, value: float) -> Point:
        """The cycle at a fixed value of the parameter, from a nearby guess."""
        border = np.zeros(5)
        border[4] = 1.0
        start = guess.copy()
        start[4] = value
        return self.point(start, border, 0.0)


def oriented(point: Point, direction: FloatArray) -> Point:
    """The same point with its tangent on the side of `direction` (scaled, shape (5,))."""
    if point.tangent @ direction >= 0.0:
        return point
    return dataclasses.replace(point, tangent=-point.tangent)


def follow(corrector: Corrector, start: Point, rule: StepRule) -> Iterator[Point]:
    """Points of the branch from `start` on, along its tangent, for as long as they are asked for.

    Raises:
        CycleError: even the smallest step does not converge.
    """
    step, here = rule.first, start
    bend = np.zeros(5)
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
    border = np.eye(5)[2] * (1.0 if here.tangent[2] >= 0.0 else -1.0)
    for size in (1e-4, 1e-3, 1e-2):
        guess = here.z + size * corrector.scale * border
        try:
            return oriented(corrector.point(guess, border, here.arclength + size), border)
        except CycleError:
            continue
    raise CycleError(
        f"continuation stuck at parameter {here.z[4]:.9g}, arclength {here.arclength:.6g}: "
        f"{failure}"
    ) from failure
