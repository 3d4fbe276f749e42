"""Held-out windows give a name back, and take a neighbour away."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from drill_env.diagnosis.fit import Fit
from drill_env.diagnosis.joint import polished
from drill_env.diagnosis.rounds import Attempt, Found, is_named
from drill_env.diagnosis.slips import Slips
from drill_env.diagnosis.strikes import Once
from drill_env.diagnosis.unseen import Unseen, unseen_of
from drill_env.identification.samples import Samples
from drill_env.prediction.criteria import Criteria


def reconsidered(
    found: Found, held: Sequence[Samples], criteria: Criteria
) -> tuple[Found, tuple[Unseen, ...]]:
    """What was found, after windows of held-out recordings were asked.

    A name that was given up for a free shape comes back if the rule takes it (`rule.chosen`): it
    predicts unseen windows, and explains nearly all of what the shape does. A second name goes if
    they list the first one and not it. Where they list nothing they say nothing: predictions of the
    next sample are more sensitive to what is small.

    Args:
        found: the search, judged.
        held: recordings that were not fitted; without them nothing is reconsidered.
        criteria: of the decision.
    """
    if not held or not found.rounds or _once(found.rounds[0].named[:1]):
        return found, ()
    first = unseen_of(found.setting, found.rounds[0], held, criteria)
    taken = first.taken
    if taken is None or not is_named(taken.term):
        return found, (first,)
    second = _second(found, taken, held, criteria)
    tables = (first,) if second is None else (first, second)
    fit = taken.fit
    if second is not None and second.taken is not None and _earned(first, second, criteria):
        fit = second.taken.fit
    wanted = [t.id for t in fit.terms]
    present = [t.id for t in found.final.terms]
    if _nameless(found):
        return _with(found, polished(found.setting, fit)), tables
    if len(present) > len(wanted) and present[: len(wanted)] == wanted and second is not None:
        return _with(found, polished(found.setting, fit)), tables
    return found, tables


def _with(found: Found, fit: Fit) -> Found:
    return replace(found, final=fit, contests={}, nameless=None, refuted=None, untold=None)


def _nameless(found: Found) -> bool:
    """Whether the verdict would be that something has no name."""
    shaped = any(not is_named(term) for term in found.final.terms)
    return shaped or found.untold is not None or found.refuted is not None


def _once(leading: Sequence[Attempt]) -> bool:
    return any(isinstance(a.term.source, (Slips, Once)) for a in leading)


def _second(
    found: Found, taken: Attempt, held: Sequence[Samples], criteria: Criteria
) -> Unseen | None:
    """The round that looked beside the name that was taken, if there was one."""
    for later in found.rounds[1:]:
        if [t.id for t in later.before.terms] == [taken.term.id]:
            return unseen_of(found.setting, later, held, criteria)
    return None


def _earned(first: Unseen, second: Unseen, criteria: Criteria) -> bool:
    """Whether what was found beside the first one is more than a remainder of it."""
    one, two = first.choice.chosen, second.choice.chosen
    if one is None or two is None or not two.named:
        return False
    return two.row.gain >= criteria.neighbour * one.row.gain
