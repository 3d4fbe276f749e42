"""Descent of a rig together with terms: joint damped Gauss-Newton steps, noise alongside."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.diagnosis.extended import evaluate, value_at
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.fit_changes import with_new_motions
from drill_env.diagnosis.joint_noise import SIZES, better_noise, still, with_noise
from drill_env.diagnosis.start_twist import twisted_by_start
from drill_env.diagnosis.terms import Shape, Term, at_rest
from drill_env.effects.along import Motion
from drill_env.identification.noise import NoiseModel
from drill_env.identification.samples import OFFSET

_TRIES = 6

_LEAST_DAMPING = 1e-9

# Damping from which on a step is a small one along a bent valley, and its most lengths. Effects
# within the filter have such valleys. A term along the smoothed motion, which knows the future,
# would be led to cancel what the rig's own parameters do.
_BENT, _FURTHEST = 1e-3, 20.0

LAST_ROUNDS = 15
"""Most rounds of a fit that is carried to its end."""

# Steps that promise less than this share of what a round must gain are not tried.
_PROMISE = 0.2

# Gain of a round below which a fit is at its end; a free shape's most rounds, and gain. It is
# linear in its numbers; over the lower speed it creeps on while it and the friction law cancel.
_ENOUGH, _SHAPE_ROUNDS = 0.5, (5, 2.0)

WORTH_A_ROUND = 2.0
"""Fall of minus twice the log likelihood that is worth a round: what a number costs (Akaike)."""

HOPE = 0.5
"""Share of what each round to come must gain on average below which a goal will not be reached."""


def _moved_terms(terms: tuple[Term, ...], step: FloatArray) -> tuple[Term, ...]:
    moved, place = [], 0
    for term in terms:
        q = term.q + step[place : place + len(term.q)]
        moved.append(Term(term.source, term.source.bounded(q)))
        place += len(term.q)
    return tuple(moved)


def _reach(setting: Setting, fit: Fit, far: bool) -> FloatArray:
    reach = [setting.coordinates.reach(fit.vector)]
    for term in fit.terms:
        if far:
            reach.append(np.full(len(term.q), np.inf))
            continue
        # A shape or an amplitude may change by half of itself at once, never less than a usual
        # size; free shapes are linear and need no limit.
        usual = 1e4 * term.source.steps(term.q)
        bent = not isinstance(term.source, Shape)
        reach.append(0.7 * usual if bent else np.full(len(term.q), np.inf))
    return np.concatenate(reach)


def _step(here: Fit, damping: float) -> FloatArray:
    """The damped Gauss-Newton step of (coordinates, terms' numbers)."""
    damped = here.information + damping * np.diag(np.diag(here.information) + 1e-12)
    # Numbers differ by many powers of ten: solve in their own sizes.
    unit = 1.0 / np.sqrt(np.diag(damped))
    return (
        unit * np.linalg.lstsq(damped * np.outer(unit, unit), unit * here.gradient, rcond=1e-13)[0]
    )


def overreaches(setting: Setting, here: Fit, damping: float) -> bool:
    """Whether a step would take the terms further than their usual sizes at once."""
    if not math.isfinite(here.value):
        return False
    return bool((np.abs(_step(here, damping)) > _reach(setting, here, False)).any())


def joint_step(
    setting: Setting,
    here: Fit,
    damping: float,
    noise: NoiseModel | None = None,
    tries: int = _TRIES,
    *,
    far: bool = False,
    least: float = 0.0,
) -> tuple[Fit, float]:
    """The best point that damped Gauss-Newton steps reach, and the damping for the next.

    Args:
        setting: recordings.
        here: where to begin.
        damping: of the first try.
        noise: model to take at the same time, the present one by default.
        tries: how often the damping may grow.
        far: whether the terms may grow by more than their usual size at once.
        least: no step is tried that promises less.
    """
    if not math.isfinite(here.value):
        return here, damping
    reach = _reach(setting, here, far)
    for tried in range(tries):
        step = _step(here, damping)
        if float(step @ here.gradient) < least:
            break
        step /= max(1.0, float((np.abs(step) / reach).max()))
        point = point_along(setting, here, step, noise)
        try:
            # Most first tries succeed; of later ones only the value is wanted.
            if tried == 0 or value_at(setting, *point) < here.value:
                there = evaluate(setting, *point)
                if there.value < here.value:
                    if damping >= _BENT and any(at_rest(term) for term in here.terms):
                        there = _further(setting, here, there)
                    return there, max(damping / (100.0 if tried == 0 else 10.0), _LEAST_DAMPING)
        except (InputError, OverflowError, np.linalg.LinAlgError):
            pass
        damping = max(10.0 * damping, 1e-4)
    return here, damping


def point_along(
    setting: Setting, here: Fit, step: FloatArray, noise: NoiseModel | None = None
) -> tuple[FloatArray, tuple[Term, ...], NoiseModel, list[FloatArray], list[Motion]]:
    """Where a step of (coordinates, terms' numbers) leads, the starts following."""
    free = len(here.vector)
    starts = [
        s + m - slope @ step
        for s, m, slope in zip(here.starts, here.start_steps, here.start_slopes, strict=True)
    ]
    return (
        here.vector + step[:free], _moved_terms(here.terms, step[free:]), noise or here.noise,
        starts, _along(setting, here, starts),
    )  # fmt: skip


def _along(setting: Setting, here: Fit, starts: Sequence[FloatArray]) -> list[Motion]:
    """The motions with other starts."""
    return [
        twisted_by_start(s, m, new[:, OFFSET] - old[:, OFFSET])
        for s, m, new, old in zip(setting.samples, here.motions, starts, here.starts, strict=True)
    ]


def _further(setting: Setting, here: Fit, there: Fit) -> Fit:
    """Where the same step leads when it is made twice as long while that gains."""
    best, value, share = None, there.value, 1.0
    while share < _FURTHEST:
        terms = tuple(
            Term(b.source, b.source.bounded(b.q + share * (b.q - a.q)))
            for a, b in zip(here.terms, there.terms, strict=True)
        )
        starts = [b + share * (b - a) for a, b in zip(here.starts, there.starts, strict=True)]
        vector = there.vector + share * (there.vector - here.vector)
        point = (vector, terms, there.noise, starts, _along(setting, there, starts))
        try:
            found = value_at(setting, *point)
        except (InputError, OverflowError, np.linalg.LinAlgError):
            break
        if not found < value:
            break
        best, value, share = point, found, 2.0 * share + 1.0
    if best is None:
        return there
    # The slopes there may be none though the value is one.
    further = evaluate(setting, *best)
    return further if further.value < there.value else there


def descend_jointly(
    setting: Setting, start: Fit, *, limit: int, enough: float,
    only: Sequence[int] | None = SIZES, goal: float = math.inf, later: int = 0,
) -> Fit:  # fmt: skip
    """As `descend_until`, where it makes no difference how it ended."""
    return descend_until(
        setting, start, limit=limit, enough=enough, only=only, goal=goal, later=later
    )[0]


def descend_until(
    setting: Setting, start: Fit, *, limit: int, enough: float,
    only: Sequence[int] | None = SIZES, goal: float = math.inf, later: int = 0,
) -> tuple[Fit, bool]:  # fmt: skip
    """Alternate joint steps and noise steps until neither gains.

    Args:
        setting: recordings.
        start: where to begin.
        limit: most rounds.
        enough: gain of a round (of minus twice the log likelihood) below which it ends.
        only: places of the noise's numbers that follow; None for all.
        goal: value that another one has: it ends early where that will not be reached.
        later: rounds that may come after these.

    Returns:
        Where it came to, and whether it is settled there: the last round gained less than enough.
    """
    if not math.isfinite(start.value):
        # Where the filter breaks down no slope leads on.
        return start, True
    here, damping, settled, least = start, 1e-4, False, _PROMISE * enough
    for left in range(limit + later - 1, later - 1, -1):
        before = here.value
        # A noise that hardly moved may rest for a round.
        noise = here.noise if settled else better_noise(setting, here, only)
        settled = not settled and still(noise, here.noise)
        there, damping = joint_step(setting, here, min(damping, 1.0), noise, 2, least=least)
        if there is here:
            here = with_noise(setting, here, noise)
            there, damping = joint_step(setting, here, min(damping, 1.0), least=least)
        here = there
        gain = before - here.value
        if gain < max(enough, HOPE * (here.value - goal) / max(left, 1)):
            return here, gain < enough
        if setting.over():
            break
    return here, False


def polished(setting: Setting, fit: Fit) -> Fit:
    """The fit carried on to its end, its motions told anew, all of the noise free."""
    shaped = bool(fit.terms) and isinstance(fit.terms[-1].source, Shape)
    rounds, enough = _SHAPE_ROUNDS if shaped else (LAST_ROUNDS, _ENOUGH)
    for _ in range(3):
        before = fit.value
        there = with_new_motions(setting, fit)
        if not math.isfinite(there.value):
            # Along the motion that it tells itself the filter breaks down: it stays where it was.
            break
        fit = descend_jointly(setting, there, limit=rounds, enough=enough, only=None)
        if abs(before - fit.value) < 5.0:
            break
    return fit
