"""Names that are one law: two functions of one coordinate at one place are one function there."""

from __future__ import annotations

from collections.abc import Sequence

from drill_env.diagnosis.explained import squares_of
from drill_env.diagnosis.fit import Fit
from drill_env.diagnosis.held_out import Judged, judge_all
from drill_env.diagnosis.rounds import Found, place_of
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import Effect
from drill_env.identification.samples import Samples
from drill_env.prediction.criteria import Criteria


def one_law(
    found: Found, held: Sequence[Samples], before: Sequence[Judged], after: Sequence[Judged],
    criteria: Criteria,
) -> dict[str, str]:  # fmt: skip
    """Of each name that only completes the law of an earlier one, that one's.

    A name stands for a curve from the share of it that it explains (`Criteria.share`), and what two
    names of one coordinate explain together is such a curve.

    Args:
        found: the search, decided.
        held: recordings that were not fitted.
        before: these under the rig alone.
        after: with all that was found.
        criteria: of the decision.
    """
    told, completing = list[Term](), dict[str, str]()
    for place, term in enumerate(found.final.terms):
        same = [t for t in told if same_curve(t, term)]
        confused = [t for t in same if easily_confused(t, term)]
        if same and not confused:
            fewer = _fit_of(found, found.final.terms[:place])
            if fewer is not None and _share(found, fewer, held, before, after) >= criteria.share:
                confused = same
        if confused:
            completing[term.id] = confused[0].id
        else:
            told.append(term)
    return completing


def same_curve(one: Term, other: Term) -> bool:
    """Whether two terms are laws of the motion at hand over one coordinate at one place."""
    laws = plain_law(one) is not None and plain_law(other) is not None
    return laws and place_of(one) == place_of(other)


def easily_confused(one: Term, other: Term) -> bool:
    """Whether two such laws are so alike that the second is what the first one's formula lacks."""
    first, second = plain_law(one), plain_law(other)
    if first is None or second is None:
        return False
    return first.id in second.neighbours and second.id in first.neighbours


def plain_law(term: Term) -> Effect | None:
    """The effect of a named term that is a law of the motion at hand: no swing, no memory.

    What most machines have is a cause of its own beside anything.
    """
    effect = term.source.effect if isinstance(term.source, Named) else None
    if effect is None or effect.common or effect.states or effect.delay:
        return None
    swings = any(p.role == "phase" for p in effect.parameters)
    return None if swings or effect.depends_on == "time" else effect


def _fit_of(found: Found, terms: Sequence[Term]) -> Fit | None:
    """The fit of the search with these names alone, the rig fitted beside them."""
    wanted = [t.id for t in terms]
    fits = [r.later or r.before for r in found.rounds]
    return next((fit for fit in fits if [t.id for t in fit.terms] == wanted), None)


def _share(
    found: Found, fewer: Fit, held: Sequence[Samples], before: Sequence[Judged],
    after: Sequence[Judged],
) -> float:  # fmt: skip
    """Share of the squared error of unseen predictions that all remove, which fewer names do."""
    if not held:
        alone, whole = found.base.bic - fewer.bic, found.base.bic - found.final.bic
    else:
        rig, all_of_them = squares_of(before).mean(), squares_of(after).mean()
        few = squares_of(judge_all(held, found.setting, fewer)).mean()
        alone, whole = rig - few, rig - all_of_them
    return alone / whole if whole > 0.0 else 0.0
