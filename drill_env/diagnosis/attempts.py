"""Candidates fitted together with the rig and the noise, the hopeful ones for longer."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from drill_env._watch import Report
from drill_env.diagnosis.extended import evaluate
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.fit_changes import added, with_new_motions, without
from drill_env.diagnosis.in_filter import moved_in
from drill_env.diagnosis.joint import (
    LAST_ROUNDS,
    WORTH_A_ROUND,
    descend_jointly,
    descend_until,
)
from drill_env.diagnosis.joint_noise import SIZES
from drill_env.diagnosis.resonance import resonates, retuned
from drill_env.diagnosis.rounds import NEEDED, Attempt, Round, is_named
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import Effect
from drill_env.identification.noise import NoiseModel
from drill_env.prediction.criteria import Criteria

FIRST_ROUNDS = 2
"""Rounds of a candidate's first descent."""

# Rounds more for candidates whose gain is not below this share of the best one's, and how many.
# The last ones get motions that are told anew with the candidate in place.
_HEATS = ((4, 0.3, 6, False), (6, 0.4, 3, True), (6, 0.5, 3, True))
# A candidate that gained less than this rests, where it is hopeless or its motions were told anew.
_MOVES = 1.0
# Resonances are retuned if they gain this share of the best one.
_HOPEFUL_RESONANCE = 0.5
# The numbers of a resonance.
_SWINGS = {"frequency", "damping"}
# How many names are begun again with the usual noise then, if they gain this share of the best
# one, and for how many rounds; and by which factor they must gain to be begun once more.
_TIGHT, _TIGHT_HOPE, _TIGHT_ROUNDS, _MOVED = 2, 0.1, 10, 1.1
# How many names, and shapes, begin again from a better fit of the rig alone.
_AGAIN = 3


def carried_on(
    setting: Setting, fit: Fit, start: Fit, rounds: int, *, anew: bool = False,
    only: Sequence[int] = SIZES, goal: float = math.inf, later: int = 0,
) -> Attempt:  # fmt: skip
    """A candidate descended for so many rounds.

    Args:
        setting: recordings and free parameters.
        fit: without the candidate.
        start: with it.
        rounds: most rounds.
        anew: whether motions are told anew with the candidate in place.
        only: places of the noise's numbers that follow.
        goal: value of another one, see `descend_jointly`.
        later: rounds that may come after these.
    """
    begin = with_new_motions(setting, start) if anew else start
    done, settled = descend_until(
        setting, begin, limit=rounds, enough=WORTH_A_ROUND, only=only, goal=goal, later=later
    )
    return replace(attempted(fit, start if done.value > start.value else done), settled=settled)


def attempted(before: Fit, fit: Fit) -> Attempt:
    """A fit with a candidate as its last term, against the fit without."""
    return Attempt(fit, fit.terms[-1], before.value - fit.value, before.bic - fit.bic)


def heated(
    setting: Setting, fit: Fit, done: list[Attempt], only: Sequence[int], report: Report
) -> list[Attempt]:
    """More rounds for the more hopeful ones, the best first; `only` as in `carried_on`."""
    resting: set[str] = set()
    for heat, (rounds, hope, most, anew) in enumerate(_HEATS):
        later = sum(rounds for rounds, *_ in _HEATS[heat + 1 :])
        done.sort(key=lambda a: -a.gain)
        least = max(hope * done[0].gain, 5.0) if done else 0.0
        for i, a in enumerate(done[:most]):
            # Along the motion at which it settled nothing more is to be found.
            settled = a.settled and not anew and only == SIZES
            if a.gain > least and a.term.id not in resting and not settled:
                if report(f"carrying on {a.term.id}"):
                    return sorted(done, key=lambda a: -a.gain)
                after = carried_on(
                    setting, fit, a.fit, rounds, anew=anew, only=only,
                    goal=goal_of(fit, a, done), later=later,
                )  # fmt: skip
                done[i] = after
                if (anew or after.criterion < NEEDED) and after.gain < a.gain + _MOVES:
                    resting.add(a.term.id)
    return sorted(done, key=lambda a: -a.gain)


def settled_within(
    setting: Setting, fit: Fit, done: Sequence[Attempt], only: Sequence[int]
) -> list[Attempt]:
    """The names worth their numbers at the filter's own state, where they are better told there."""
    after = []
    for a in done:
        worth = is_named(a.term) and a.criterion > NEEDED
        inside = moved_in(setting, a.fit) if worth else a.fit
        moved = inside is not a.fit
        after.append(carried_on(setting, fit, inside, FIRST_ROUNDS, only=only) if moved else a)
    return sorted(after, key=lambda a: -a.gain)


def confused_with(done: Sequence[Attempt], effects: Sequence[Effect]) -> list[Effect]:
    """Effects that the best name is easily taken for."""
    names = [a.term.source for a in done if is_named(a.term) and a.criterion > NEEDED]
    if not names or not isinstance(names[0], Named):
        return []
    best = names[0].effect
    return [e for e in effects if e.id in best.neighbours or best.id in e.neighbours]


def tuned_alike(
    setting: Setting, fit: Fit, done: Sequence[Attempt], effects: Sequence[Effect]
) -> list[Attempt]:
    """The attempts and those at the frequency of the best name with what it is easily taken for.

    A little damped resonance is a narrow peak, which a coarse grid misses: what swings there, but
    elsewhere in the rig, is found from there.

    Args:
        setting: recordings and free parameters.
        fit: without candidates.
        done: attempts, the best first.
        effects: what may be offered.
    """
    best = next((a for a in done if is_named(a.term) and a.criterion > NEEDED), None)
    if best is None or not isinstance(best.term.source, Named):
        return list(done)
    told = dict(zip((p.name for p in best.term.source.effect.parameters), best.term.q, strict=True))
    others = [e for e in confused_with(done, effects) if {p.name for p in e.parameters} >= _SWINGS]
    more = []
    for effect in others if set(told) >= _SWINGS else ():
        q = [told[p.name] if p.name in _SWINGS else p.grid[0] for p in effect.parameters]
        start = added(setting, fit, Term(Named(effect), np.array(q)))
        more.append(carried_on(setting, fit, moved_in(setting, start), FIRST_ROUNDS))
    return best_of_each([*done, *more])


def goal_of(fit: Fit, attempt: Attempt, done: Sequence[Attempt]) -> float:
    """Value of the best of its sort: names race names, shapes race all.

    A shape of which a name explains the share from which it stands for it decides nothing.
    """
    rivals = [a.gain for a in done if is_named(a.term) or not is_named(attempt.term)]
    if not is_named(attempt.term):
        rivals += [a.gain / Criteria().share for a in done if is_named(a.term)]
    return fit.value - max(rivals, default=-math.inf)


def with_resonances_retuned(setting: Setting, fit: Fit, done: list[Attempt]) -> list[Attempt]:
    """Hopeful resonances at their best frequency, the best attempts first."""
    least = max(_HOPEFUL_RESONANCE * max((a.gain for a in done), default=0.0), NEEDED)
    done = [
        attempted(fit, retuned(setting, a.fit)) if resonates(a.term) and a.gain > least else a
        for a in done
    ]
    return sorted(done, key=lambda a: -a.gain)


def tightened(
    setting: Setting, fit: Fit, done: Sequence[Attempt], usual: Mapping[str, float]
) -> list[Attempt]:
    """The most hopeful names begun again with the usual noise where theirs is not, as it is named.

    A torque that is slow and large follows what is missing, and holds no number in its place: a
    descent ends anywhere. Under little noise all numbers are told, from far away too.
    """
    again = []
    noise = replace(fit.noise, **usual)
    names = [a for a in done if is_named(a.term)][:_TIGHT]
    for attempt in [a for a in names if a.gain >= _TIGHT_HOPE * names[0].gain]:
        first = _begun_again(setting, fit, attempt, noise)
        again.append(first)
        if first.gain > _MOVED * attempt.gain + _MOVES:
            again.append(_begun_again(setting, fit, first, noise))
    return again


def _begun_again(setting: Setting, fit: Fit, attempt: Attempt, noise: NoiseModel) -> Attempt:
    """A candidate descended from where its numbers join the rig, under another noise."""
    here = added(setting, fit, attempt.term)
    start = evaluate(setting, here.vector, here.terms, noise, here.starts, here.motions)
    there = descend_jointly(
        setting, start, limit=_TIGHT_ROUNDS, enough=WORTH_A_ROUND, only=None, goal=attempt.fit.value
    )
    return attempted(fit, there)


def refitted_alone(setting: Setting, found: Round) -> Round:
    """The search from where the rig alone comes to by what the best attempt made of it.

    The likelihood has several peaks over a rig that is far off. Where an attempt comes to a higher
    one, whatever was tried gains what the rig gains alone.

    Args:
        setting: recordings and free parameters.
        found: what was searched, at the rig alone.

    Returns:
        The same where the rig alone gains no more than an effect must; or else a round at the
        better fit, at which the best attempts have begun again.
    """
    fit, best = found.before, found.best
    if best is None or best.criterion <= NEEDED:
        return found
    alone = descend_jointly(
        setting, without(setting, best.fit, 0), limit=LAST_ROUNDS, enough=WORTH_A_ROUND,
        only=None, goal=fit.value,
    )  # fmt: skip
    if fit.value - alone.value <= NEEDED:
        return found
    tried = [*found.named, *found.shapes]
    again = [
        carried_on(setting, alone, added(setting, alone, a.term), _TIGHT_ROUNDS)
        for a in (*found.named[:_AGAIN], *found.shapes[:_AGAIN])
    ]
    done = best_of_each([*again, *(attempted(alone, a.fit) for a in tried)])
    named, shapes = ([a for a in done if is_named(a.term) == kind] for kind in (True, False))
    return replace(found, before=alone, named=tuple(named), shapes=tuple(shapes))


def best_of_each(done: Sequence[Attempt]) -> list[Attempt]:
    """Attempts by criterion, the best of each candidate only."""
    best: dict[str, Attempt] = {}
    for attempt in sorted(done, key=lambda a: -a.criterion):
        best.setdefault(attempt.term.id, attempt)
    return list(best.values())


def restated(first: Round, fit: Fit) -> Round:
    """A round in which the last term of a fit does as well as it does there."""
    term = fit.terms[-1]
    named = [attempted(first.before, fit), *(a for a in first.named if a.term.id != term.id)]
    return replace(first, named=tuple(best_of_each(named)))
