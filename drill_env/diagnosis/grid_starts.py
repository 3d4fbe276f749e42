"""Where to begin with effects that no number makes vanish in proportion.

The slopes of the likelihood at the rig without them tell little of a play, a delay or a resonance:
what they change is no multiple of anything. The likelihood itself has several peaks over their
numbers, and the highest one may show only after the rig has followed: descents begin at several.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.attempts import attempted, goal_of
from drill_env.diagnosis.extended import value_at
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.fit_changes import added, gain_of, own_values
from drill_env.diagnosis.grids import grid_of
from drill_env.diagnosis.in_filter import moved_in
from drill_env.diagnosis.joint import WORTH_A_ROUND, descend_jointly
from drill_env.diagnosis.linearised import Linearised
from drill_env.diagnosis.rounds import Attempt, is_named
from drill_env.diagnosis.stiction_starts import alone
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import Effect

# Peaks at which descents begin, and rounds of the one that goes on.
_PEAKS, _ROUNDS = 3, 12
# Share of what the best name explains of the worst recording from which the others are asked: they
# have less that is wrong, so what falls further behind there does not come to the front by them.
_BESIDE = 0.5
# Points closer than this factor in every number are on one peak.
_CLOSE = 1.3


def has_peaks(effect: Effect) -> bool:
    """Whether the likelihood has several peaks over the numbers of an effect without a size."""
    return len(effect.parameters) > 1 and all(p.role != "amplitude" for p in effect.parameters)


def descended(linearised: Linearised, effect: Effect, done: Sequence[Attempt]) -> Attempt | None:
    """The best attempt with such an effect from the highest peaks.

    The recording that is explained worst is asked alone first: the rig follows for one round at
    each peak, and where that leads highest the descent goes on. All recordings are asked where it
    explains that one about as well as the best name does.

    Args:
        linearised: where it joins.
        effect: it.
        done: attempts with others.

    Returns:
        None where it explains that recording far worse than the best name.
    """
    setting, fit, source = linearised.setting, linearised.fit, Named(effect)
    points = [source.bounded(q) for q in grid_of(effect, linearised)]
    worst = max(
        range(len(linearised.known)), key=lambda i: float(np.mean(linearised.known[i].white ** 2))
    )
    one = alone(setting, fit, worst)
    own = value_at(one[0], fit.vector, fit.terms, fit.noise, one[1].starts, one[1].motions)
    best = _best_value(one[0], done, worst)
    starts = [added(*one, Term(source, q)) for q in _peaks(points, _gains(*one, source, points))]
    starts = [descend_jointly(one[0], s, limit=1, enough=1.0, only=None) for s in starts]
    first = min(starts, key=lambda there: there.value)
    first = _raced(one[0], first, best)
    inside = moved_in(one[0], first)
    if inside is not first:
        # Along a motion that knows the future a gear may follow anything.
        first = _raced(one[0], inside, best)
    if own - first.value < _BESIDE * (own - best):
        return None
    # With the noise of the rig alone: that of one recording may be far too small for another.
    start = added(setting, replace(fit, vector=first.vector), first.terms[-1])
    return attempted(fit, _raced(setting, start, goal_of(fit, attempted(fit, start), done)))


def _raced(setting: Setting, start: Fit, goal: float) -> Fit:
    return descend_jointly(
        setting, start, limit=_ROUNDS, enough=WORTH_A_ROUND, only=None, goal=goal
    )


def _best_value(setting: Setting, done: Sequence[Attempt], place: int) -> float:
    """Least value of one recording under the names that were tried; none is infinite."""
    values = [math.inf]
    for attempt in (a for a in done if is_named(a.term)):
        at, own = attempt.fit, ((attempt.fit.starts[place],), (attempt.fit.motions[place],))
        values.append(value_at(setting, at.vector, at.terms, at.noise, *own))
    return min(values)


def _gains(setting: Setting, fit: Fit, source: Named, points: Sequence[FloatArray]) -> list[float]:
    own = own_values(setting, fit)
    return [gain_of(setting, fit, Term(source, q), own) for q in points]


def _peaks(points: Sequence[FloatArray], gains: Sequence[float]) -> list[FloatArray]:
    """The best points that are apart from each other."""
    found: list[FloatArray] = []
    for i in sorted(range(len(points)), key=lambda i: -gains[i]):
        q = np.maximum(points[i], 1e-12)
        if all(np.abs(np.log(q / np.maximum(f, 1e-12))).max() > np.log(_CLOSE) for f in found):
            found.append(points[i])
        if len(found) == _PEAKS:
            break
    return found
