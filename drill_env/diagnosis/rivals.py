"""Terms of a fit against their rivals and against none, each beside the other terms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drill_env._watch import Report
from drill_env.diagnosis.attempts import attempted, best_of_each
from drill_env.diagnosis.extended import evaluate
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.fit_changes import added, without
from drill_env.diagnosis.joint import WORTH_A_ROUND, descend_jointly, polished
from drill_env.diagnosis.lost_counts import LostCounts
from drill_env.diagnosis.rounds import NEEDED, NEEDED_BESIDE, Round, limit_reached, place_of
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import Effect
from drill_env.prediction.criteria import Criteria

_TRY_ROUNDS, _RIVAL_ROUNDS = 6, 10
# Of the round in which a term was found, tried again beside what was found later.
_RIVALS = 3


def against_rivals(setting: Setting, fit: Fit, rounds: Sequence[Round]) -> tuple[Fit, list[Round]]:
    """Ask again, beside what was found later, whether what was found first is the right one.

    The last term is asked too whether it is needed: what it gained may be that the others went on.

    Args:
        setting: recordings and free parameters.
        fit: with all terms.
        rounds: in which they were found, the first one first.

    Returns:
        The fit with what won, and the rounds. A term without which the others do as well is gone.
        Where they do better without it than they did before, that is what it is held against.
    """
    last = len(fit.terms) - 1
    for place in range(last):
        fewer = best_without(setting, fit, place)
        if fewer.bic - fit.bic < NEEDED:
            return fewer, list(rounds)
        present = {t.id for t in fit.terms}
        rivals = [a for a in rounds[place].named if a.term.id not in present][:_RIVALS]
        if isinstance(fit.terms[place].source, LostCounts):
            rivals = []
        best = fit
        for rival in rivals:
            start = added(setting, fewer, rival.term)
            goal = best.bic - start.bic + start.value
            tried = descend_jointly(
                setting, start, limit=_RIVAL_ROUNDS, enough=WORTH_A_ROUND, goal=goal
            )
            if tried.bic < best.bic:
                best = tried
        if best is not fit:
            # The new one stands last: the order of the terms is that of the rounds.
            order = (*best.terms[:place], best.terms[-1], *best.terms[place:-1])
            best = evaluate(setting, best.vector, order, best.noise, best.starts, best.motions)
            fit = polished(setting, best)
    if last < 1:
        return fit, list(rounds)
    fewer = best_without(setting, fit, last)
    if fewer.bic - fit.bic < NEEDED:
        return fewer, list(rounds)
    return fit, [_gone_on(setting, found, fewer) for found in rounds]


def _gone_on(setting: Setting, found: Round, fewer: Fit) -> Round:
    """A round that began with the same terms, and where these went on to."""
    same = [t.id for t in found.before.terms] == [t.id for t in fewer.terms]
    if not same or fewer.value > found.before.value - WORTH_A_ROUND:
        return found
    return replace(found, later=polished(setting, fewer))


def at_limits(setting: Setting, fit: Fit, effects: Sequence[Effect]) -> Fit:
    """The fit with the simpler effect in place of one whose numbers came to where it is that.

    Args:
        setting: recordings and free parameters.
        fit: at its peak.
        effects: the library.
    """
    for place, term in enumerate(fit.terms):
        other = next((e for e in effects if e.id == limit_reached(term)), None)
        if isinstance(term.source, Named) and other is not None:
            names = [p.name for p in term.source.effect.parameters]
            q = np.array([term.q[names.index(p.name)] for p in other.parameters])
            simpler = Term(replace(term.source, effect=other, probe=()), q)
            terms = (*fit.terms[:place], simpler, *fit.terms[place + 1 :])
            here = evaluate(setting, fit.vector, terms, fit.noise, fit.starts, fit.motions)
            fit = min(fit, polished(setting, here), key=lambda there: there.bic)
    return fit


def refined(
    setting: Setting, found: Round, effects: Sequence[Effect], report: Report
) -> tuple[Round, Fit]:
    """The best name of a round carried to its end, and a close rival, which may then be better.

    Args:
        setting: recordings and free parameters.
        found: the round.
        effects: the library.
        report: told what is done next.

    Returns:
        The round with what was carried on, and the fit of the better one.
    """
    fits = []
    for attempt in found.named[:2]:
        if attempt.criterion > found.named[0].criterion - NEEDED_BESIDE:
            report(f"refining {attempt.term.id}")
            fits.append(at_limits(setting, polished(setting, attempt.fit), effects))
    # Each had been told along a motion of its own of some rounds ago. The better one keeps the lead
    # over the names that are not refined, the other one falls behind by what it is worse.
    best = min(fits, key=lambda fit: fit.bic)
    lead = found.named[0].criterion - attempted(found.before, best).criterion
    told = [attempted(found.before, fit) for fit in fits]
    told = [replace(a, gain=a.gain + lead, criterion=a.criterion + lead) for a in told]
    return replace(found, named=tuple(best_of_each([*told, *found.named[len(fits) :]]))), best


def with_rival_shape(setting: Setting, found: Round, best: Fit) -> Round:
    """The round with its best free shape elsewhere carried to its end, where that may go before.

    Descents of shapes end where they seem to decide nothing; what is compared has come to its end.
    A shape at the name's place over the same coordinate is the name's own curve, and no rival.

    Args:
        setting: recordings and free parameters.
        found: the round, its best name refined.
        best: the fit of that name.
    """
    name = found.named[0]
    elsewhere = [a for a in found.shapes if place_of(a.term) != place_of(name.term)]
    shape = elsewhere[0] if elsewhere else None
    if shape is None or shape.criterion < Criteria().share * name.criterion:
        return found
    others = [a for a in found.shapes if a is not shape]
    # On the scale of the name's own criterion.
    lead = name.criterion - attempted(found.before, best).criterion
    there = attempted(found.before, polished(setting, shape.fit))
    there = replace(there, gain=there.gain + lead, criterion=there.criterion + lead)
    return replace(found, shapes=tuple(best_of_each([there, *others])))


def best_without(setting: Setting, fit: Fit, place: int) -> Fit:
    """The best fit near, with one term fewer.

    Args:
        setting: recordings and free parameters.
        fit: with the terms.
        place: of the term that goes.
    """
    start = without(setting, fit, place)
    return descend_jointly(setting, start, limit=_TRY_ROUNDS, enough=1.0, only=None)
