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

from drill_env._threads import each
from drill_env._types import FloatArray
from drill_env._watch import Report
from drill_env.diagnosis.attempts import attempted, goal_of
from drill_env.diagnosis.extended import evaluate
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.fit_changes import added, gain_of, own_values
from drill_env.diagnosis.grids import gains_over, grid_of
from drill_env.diagnosis.in_filter import moved_in
from drill_env.diagnosis.joint import WORTH_A_ROUND, descend_jointly
from drill_env.diagnosis.linearised import Linearised
from drill_env.diagnosis.rounds import NEEDED, Attempt, is_named
from drill_env.diagnosis.stiction_starts import alone
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import Effect

# Peaks at which descents begin, and rounds of the one that goes on.
_PEAKS, _ROUNDS = 3, 12
# Share of what the best name explains of the worst recording from which all are asked.
_BESIDE = 0.5
# Points closer than this factor in every number are on one peak.
_CLOSE = 1.3


def has_peaks(effect: Effect) -> bool:
    """Whether the likelihood has several peaks over the numbers of an effect without a size."""
    return len(effect.parameters) > 1 and all(p.role != "amplitude" for p in effect.parameters)


def descended(
    linearised: Linearised, effects: Sequence[Effect], done: Sequence[Attempt], report: Report
) -> list[Attempt]:
    """The best attempt with each of such effects that is worth one, from the highest peaks.

    The recording that is explained worst is asked alone first: the rig follows for one round at
    each peak, and where that leads highest the descent goes on. Fitted to it alone, as the rig and
    the best name are, an effect shows there what it can do at best. All recordings are asked where
    it would be worth its numbers if the others were as bad, beside what the best name does there;
    they choose again among the peaks, since what fits one recording best may suit no other.

    Args:
        linearised: where they join.
        effects: they.
        done: attempts with others.
        report: told what is done next, see `Report`.
    """
    setting, fit, found = linearised.setting, linearised.fit, list(done)
    if not effects:
        return found
    worst = max(
        range(len(linearised.known)), key=lambda i: float(np.mean(linearised.known[i].white ** 2))
    )
    one = alone(setting, fit, worst)
    plain = best = _fitted_alone(*one)
    names = [a for a in done if is_named(a.term)]
    if names:
        best = min(best, _fitted_alone(*alone(setting, names[0].fit, worst)))
    for effect in effects:
        if report(f"trying {effect.id}"):
            break
        source, points = Named(effect), grid_of(effect, linearised)
        price = NEEDED + len(effect.parameters) * math.log(max(fit.count, 2))
        wanted = max(price / len(setting.samples), _BESIDE * (plain - best))
        there, peaks = _best_alone(*one, source, points, plain - wanted)
        if plain - there.value > wanted:
            # With the noise of the rig alone: that of one recording may be far too small for
            # another.
            tried = (there, *(moved_in(one[0], peak) for peak in peaks))
            starts = [added(setting, replace(fit, vector=f.vector), f.terms[-1]) for f in tried]
            start = min(starts, key=lambda f: f.value)
            if not math.isfinite(start.value):
                continue
            goal = goal_of(fit, attempted(fit, start), found)
            found.append(attempted(fit, _raced(setting, start, goal)))
            best = min(best, there.value)
    return found


def _fitted_alone(setting: Setting, fit: Fit) -> float:
    start = evaluate(setting, fit.vector, fit.terms, fit.noise, fit.starts, fit.motions)
    return _raced(setting, start).value


def _best_alone(
    setting: Setting, fit: Fit, source: Named, grid: Sequence[FloatArray], goal: float
) -> tuple[Fit, list[Fit]]:
    """The lowest point with an effect from the highest peaks of one recording, and these."""
    points = [source.bounded(q) for q in grid]
    own = own_values(setting, fit)
    gains = gains_over(
        points, lambda some: each(lambda q: gain_of(setting, fit, Term(source, q), own), some)
    )
    peaks = _peaks(points, gains)

    def followed(q: FloatArray) -> Fit:
        start = added(setting, fit, Term(source, q))
        return descend_jointly(setting, start, limit=1, enough=1.0, only=None)

    starts = each(followed, peaks)
    first = _raced(setting, min(starts, key=lambda there: there.value), goal)
    inside = moved_in(setting, first)
    # Along a motion that knows the future a gear may follow anything.
    best = first if inside is first else _raced(setting, inside, goal)
    return best, starts


def _raced(setting: Setting, start: Fit, goal: float = math.inf) -> Fit:
    return descend_jointly(
        setting, start, limit=_ROUNDS, enough=WORTH_A_ROUND, only=None, goal=goal
    )


def _peaks(points: Sequence[FloatArray], gains: FloatArray) -> list[FloatArray]:
    """The best points that are apart from each other."""
    found: list[FloatArray] = []
    for i in np.argsort(-gains, kind="stable"):
        q = np.maximum(points[i], 1e-12)
        if all(np.abs(np.log(q / np.maximum(f, 1e-12))).max() > np.log(_CLOSE) for f in found):
            found.append(points[i])
        if len(found) == _PEAKS:
            break
    return found
