"""Profiles of the likelihood over the numbers of effects within the filter.

Gauss-Newton steps hold the filter's gains, and each disc that comes to rest or leaves it makes the
likelihood jump. So where the slopes say that a fit is at its end a number may still lead on, and
their curvature may say little of how uncertain it is. Each is moved until the readings have become
improbable, all else following (Venzon and Moolgavkar, Applied Statistics 37 (1988) 87-94).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.diagnosis.extended import evaluate, value_at
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.intervals import Z_95
from drill_env.diagnosis.joint import WORTH_A_ROUND, joint_step, point_along
from drill_env.diagnosis.terms import Named, Term, at_rest
from drill_env.identification.coordinates import inverse

# Steps to one side, each as long as all before it; steps in which all else follows one of them.
_STEPS, _FOLLOWING = 5, 2
# Deviations from a fit at which a smooth likelihood rises by their square alone, 0.25 of the 3.84
# at an interval's end: what it rises beyond that is roughness.
_NEAR = 0.5
# Falls of minus twice the log likelihood that are worth no step: they move an interval's end, where
# it is 3.84, by a hundredth.
_PROMISE = 0.1


@dataclass(frozen=True, slots=True)
class _Side:
    """One side of a profile.

    Attributes:
        end: how far from the fit the interval ends.
        better: a fit on the way that is more likely by more than a number costs.
    """

    end: float
    better: Fit | None = None


def interval_ends(setting: Setting, fit: Fit) -> tuple[FloatArray, Fit | None]:
    """How far below and above its value each of the terms' numbers may be.

    Args:
        setting: recordings.
        fit: at its end by its slopes.

    Returns:
        Half-widths of 95 % intervals, shape (numbers, 2), 0 where the slopes tell them, and None;
        or a better fit that was met, from which a descent is to begin.
    """
    ends = np.zeros((fit.numbers, 2))
    numbers = [(term, i) for term in fit.terms for i in range(len(term.q))]
    for row, (term, i) in enumerate(numbers):
        # Of a torque along the smoothed motion the readings' likelihood is as its slopes say.
        for column, sign in enumerate((-1.0, 1.0) if at_rest(term) else ()):
            far = _first(fit, len(fit.vector) + row, term, i)
            side = _side(setting, fit, len(fit.vector) + row, sign * far, _room(term, i, sign))
            if side.better is not None:
                return ends, side.better
            ends[row, column] = side.end
    return ends, None


def _room(term: Term, i: int, sign: float) -> float:
    """How far a number may go to one side within its range."""
    if isinstance(term.source, Named) and term.source.effect.parameters[i].role == "phase":
        return math.pi
    q = term.q.copy()
    q[i] = sign * math.inf
    return sign * float(term.source.bounded(q)[i] - term.q[i])


def _first(fit: Fit, place: int, term: Term, i: int) -> float:
    """How far a number's interval reaches by the curvature and the allowance for the formula."""
    p = term.source.effect.parameters[i] if isinstance(term.source, Named) else None
    form = p.form if p is not None and p.role != "phase" else 0.0
    return Z_95 * math.hypot(float(_ridge(fit, place)[place]), form * float(term.q[i]))


def _side(setting: Setting, fit: Fit, place: int, first: float, room: float) -> _Side:
    """One side of a number that has so much room there, asked first at a distance."""
    sign, far = math.copysign(1.0, first), abs(first)
    deviation = float(_ridge(fit, place)[place])
    # A descent over a rough likelihood ends on a spike. What lies beside it is the level from
    # which the profile has to rise.
    near = _rise(setting, fit, fit, place, sign * min(_NEAR * deviation, room))
    spike = max(near - _NEAR**2, 0.0) if math.isfinite(near) else 0.0
    goal = fit.value + spike + Z_95**2
    here, at, low, root, best = fit, 0.0, 0.0, 0.0, -WORTH_A_ROUND
    better = None
    for _ in range(_STEPS):
        far = min(far, room)
        rise = _rise(setting, fit, here, place, sign * (far - at))
        if not best < rise or not _root(rise, spike) < Z_95:
            try:
                here, value = _followed(setting, here, place, sign * (far - at), goal)
                at, rise = far, value - fit.value
            except (InputError, OverflowError, np.linalg.LinAlgError):
                rise = math.inf
        if rise < best:
            best, better = rise, here
        elif better is not None:
            break
        reached = _root(rise, spike)
        if not reached < Z_95:
            return _Side(low + (far - low) * (Z_95 - root) / (reached - root))
        if far >= room:
            break
        low, root, far = far, reached, 2.0 * far
    return _Side(far, better)


def _root(rise: float, spike: float) -> float:
    """The root of a rise, which is nearly linear in a number."""
    return math.sqrt(max(rise - spike, 0.0))


def _ridge(fit: Fit, place: int) -> FloatArray:
    """How all of (coordinates, terms' numbers) follow one of them by one deviation of it."""
    covariance = inverse(fit.information)
    return covariance[:, place] / math.sqrt(max(float(covariance[place, place]), 1e-300))


def _step(here: Fit, place: int, distance: float) -> FloatArray:
    ridge = _ridge(here, place)
    if not ridge[place] > 0.0:
        raise np.linalg.LinAlgError("the slopes tell nothing of this number")
    return distance / float(ridge[place]) * ridge


def _rise(setting: Setting, fit: Fit, here: Fit, place: int, distance: float) -> float:
    """How much less likely than a fit it is along a ridge; infinity where there is no sense."""
    try:
        value = value_at(setting, *point_along(setting, here, _step(here, place, distance)))
    except (InputError, OverflowError, np.linalg.LinAlgError):
        return math.inf
    return value - fit.value if math.isfinite(value) else math.inf


def _followed(
    setting: Setting, here: Fit, place: int, distance: float, goal: float
) -> tuple[Fit, float]:
    """The fit with a number moved and all else at its best, and the value there.

    Where all else promises no fall below a goal, the value is what it promises.
    """
    there = evaluate(setting, *point_along(setting, here, _step(here, place, distance)))
    damping = 1e-4
    for _ in range(_FOLLOWING if math.isfinite(there.value) else 0):
        held = _held(there, place)
        promise = float(held.gradient @ inverse(held.information) @ held.gradient)
        if not there.value - promise < goal:
            return there, there.value - promise
        after, damping = joint_step(setting, held, damping, tries=2, least=_PROMISE)
        if after is held:
            break
        there = after
    return there, there.value


def _held(fit: Fit, place: int) -> Fit:
    """The fit in which no step moves a number."""
    information, gradient = fit.information.copy(), fit.gradient.copy()
    information[place] = information[:, place] = gradient[place] = 0.0
    information[place, place] = 1.0
    return replace(fit, information=information, gradient=gradient)
