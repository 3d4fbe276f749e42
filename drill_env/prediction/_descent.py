"""Descents to the best numbers of a rig with candidates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drill_env._errors import InputError
from drill_env._threads import each
from drill_env._types import BoolArray, FloatArray
from drill_env.integrator.prepared import Prepared
from drill_env.integrator.windows import METHOD
from drill_env.parameters import Rig
from drill_env.prediction.candidate import Candidate
from drill_env.prediction.cut import Cut, rounding_of
from drill_env.prediction.likelihood import FAR, log_density, scales, weights
from drill_env.prediction.setting import Setting

# Times that slopes are taken by differences, and the gain in nats that is worth another one: a
# number of pure noise gains half a nat (Wilks 1938).
_ROUNDS, _ENOUGH = 15, 0.02
_DAMPING, _TRIES = 1e-3, 7
# Share of what a step promises from which its slopes are good for another one, as of the radius of
# trust (Nocedal and Wright, Numerical Optimization, 2006, algorithm 4.1).
_KEPT = 0.25
_STEP, _NUMBER_STEP = 1e-4, 1e-3
# In scales of the errors: towards a prediction that failed, which is `FAR` off, there is no slope.
_STEEPEST = 1e8
# Standard deviation of a free shape's values, in usual sizes.
_SHAPE_SPREAD = 2.0


def errors_of_rig(rig: Rig, shift: float, cuts: Sequence[Cut]) -> FloatArray:
    """Errors of a rig's predictions of recordings, shape (w, k, c)."""
    prepared = Prepared(rig, METHOD)
    return np.concatenate([cut.errors(prepared, shift) for cut in cuts])


def rig_at(setting: Setting, candidates: Sequence[Candidate], x: FloatArray) -> Rig:
    """The rig at a vector of all numbers.

    Raises:
        InputError: there is none.
    """
    place = len(setting.centre)
    added = []
    for candidate in candidates:
        added.append(candidate.entry(x[place : place + candidate.size]))
        place += candidate.size
    return setting.rig(x, added)


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """Numbers of a rig and its candidates, and how it predicts.

    Attributes:
        x: all numbers.
        errors: of all windows, shape (w, k, c).
        size: scales of the errors, shape (k, c).
        value: log density of all windows and of the numbers, nats.
    """

    x: FloatArray
    errors: FloatArray
    size: FloatArray
    value: float


class Descent:
    """The search for the best numbers of a rig with candidates."""

    def __init__(self, setting: Setting, candidates: tuple[Candidate, ...]) -> None:
        self.setting, self.candidates = setting, candidates
        self.rounding = rounding_of(setting.cuts)
        centre, spread, reach = setting.centre, setting.spread, setting.criteria.reach
        self.centre = np.concatenate([centre, *[np.zeros(c.size) for c in candidates]])
        shapes = [np.full(c.size, _SHAPE_SPREAD if c.table else np.inf) for c in candidates]
        self.spread = np.concatenate([spread, *shapes])
        self.low = np.concatenate([centre - reach * spread, *[c.low for c in candidates]])
        self.high = np.concatenate([centre + reach * spread, *[c.high for c in candidates]])
        own = np.minimum(_STEP * np.maximum(np.abs(centre), 1.0), 0.01 * spread)
        own[-1] = 0.05
        self.steps = np.concatenate([own, *[np.full(c.size, _NUMBER_STEP) for c in candidates]])

    def errors(self, points: Sequence[FloatArray]) -> list[FloatArray | None]:
        """At several points; nothing where the numbers make no rig."""

        def one(x: FloatArray) -> FloatArray | None:
            try:
                rig = rig_at(self.setting, self.candidates, x)
                return errors_of_rig(rig, float(x[self.setting.shift]), self.setting.cuts)
            except InputError:
                return None

        return each(one, points)

    def value(self, errors: FloatArray, size: FloatArray, x: FloatArray) -> float:
        """Log density of the windows and of the numbers."""
        known = float(np.sum(((x - self.centre) / self.spread) ** 2))
        degrees = self.setting.criteria.degrees
        return float(log_density(errors, size, degrees).sum()) - 0.5 * known

    def slopes(self, x: FloatArray, errors: FloatArray) -> FloatArray:
        """Derivatives of the errors by all numbers; 0 where they cannot be had."""
        steps = np.where(x + self.steps > self.high, -self.steps, self.steps)
        moved = self.errors([x + step for step in np.diag(steps)])
        columns = [
            np.zeros_like(errors) if there is None else (there - errors) / step
            for there, step in zip(moved, steps.tolist(), strict=True)
        ]
        return np.stack(columns, axis=3)

    def run(self, x: FloatArray) -> Point:
        """From a point to the best one near it.

        Slopes by differences are most of the work. After a step they are carried on by what it
        changed (Broyden; Madsen, Nielsen and Tingleff, Methods for Non-Linear Least Squares
        Problems, 2004, section 3.4) while steps bring what they promise; it ends by slopes of its
        own alone.
        """
        x, damping, columns, left = np.clip(x, self.low, self.high), _DAMPING, None, _ROUNDS
        errors = self._required(x)
        here = self._point(x, errors, self._scales(errors))
        while True:
            fresh = columns is None
            if columns is None:
                columns, left = self.slopes(here.x, here.errors), left - 1
            pull, curvature = self._normal(columns, here)
            before = here
            for _ in range(_TRIES if fresh else 1):
                step = self._step(here.x, pull, curvature, damping)
                there = self._beyond(here, step)
                if there is not None and there.value > here.value:
                    here, damping = there, max(damping / 5.0, 1e-6)
                    break
                if fresh:
                    damping *= 6.0
            gain, moved = here.value - before.value, here.x - before.x
            if fresh and (gain < _ENOUGH or left == 0) or self.setting.over():
                break
            promised = float(pull @ moved - 0.5 * moved @ curvature @ moved)
            good = moved.any() and gain >= max(_ENOUGH, _KEPT * promised)
            columns = self._carried_on(columns, before, here) if good else None
        return here

    def _scales(self, errors: FloatArray, first: FloatArray | None = None) -> FloatArray:
        return scales(errors, self.setting.criteria.degrees, first, self.rounding)

    def _point(self, x: FloatArray, errors: FloatArray, size: FloatArray) -> Point:
        return Point(x, errors, size, self.value(errors, size, x))

    def _beyond(self, here: Point, step: FloatArray) -> Point | None:
        """Where a step leads; None where the numbers make no rig."""
        x = np.clip(here.x + step, self.low, self.high)
        errors = self.errors([x])[0]
        if errors is None:
            return None
        return self._point(x, errors, self._scales(errors, here.size))

    def _carried_on(self, columns: FloatArray, before: Point, here: Point) -> FloatArray:
        """Slopes that explain a step, changed as little as that takes in units of own steps."""
        moved = here.x - before.x
        along, left = moved / self.steps**2, here.errors - before.errors - columns @ moved
        return columns + left[..., np.newaxis] * along / float(along @ moved)

    def _required(self, x: FloatArray) -> FloatArray:
        errors = self.errors([x])[0]
        if errors is None:
            rig_at(self.setting, self.candidates, x)
            return np.full_like(np.concatenate([c.target for c in self.setting.cuts]), FAR)
        return errors

    def _normal(self, columns: FloatArray, here: Point) -> tuple[FloatArray, FloatArray]:
        """Downhill direction and curvature."""
        columns = columns / here.size[..., np.newaxis]
        columns[np.abs(columns) > _STEEPEST] = 0.0
        weight = weights(here.errors, here.size, self.setting.criteria.degrees)
        heavy = np.sqrt(weight)
        flat = (columns * heavy[..., np.newaxis]).reshape(-1, len(here.x))
        known = 1.0 / self.spread**2
        told = -flat.T @ (here.errors / here.size * heavy).ravel()
        return told - (here.x - self.centre) * known, flat.T @ flat + np.diag(known)

    def _step(
        self, x: FloatArray, pull: FloatArray, curvature: FloatArray, damping: float
    ) -> FloatArray:
        """Damped step, along the bounds where it would leave them."""
        damped = curvature + np.diag(damping * np.diag(curvature) + 1e-12)
        free = np.ones(len(x), dtype=np.bool_)
        step = np.zeros(len(x))
        for _ in range(3):
            step = np.zeros(len(x))
            step[free] = np.linalg.lstsq(damped[np.ix_(free, free)], pull[free], rcond=None)[0]
            held = self._leaves(x, step) & free
            if not held.any():
                break
            free &= ~held
        return step

    def _leaves(self, x: FloatArray, step: FloatArray) -> BoolArray:
        return ((x <= self.low) & (step < 0.0)) | ((x >= self.high) & (step > 0.0))
