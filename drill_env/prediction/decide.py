"""The decision: what is missing, how finely it can be told, and what else it may be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from drill_env._watch import Report
from drill_env.prediction.candidate import Candidate
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.fit import Fit, fit
from drill_env.prediction.rule import NO_GRADES, Entrant, Grades, chosen
from drill_env.prediction.search import Fold, Round, Tried, searched


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """What one round came to.

    Attributes:
        found: the round.
        chosen: the candidate that is taken, a name or a free shape; None if none is listed.
        share: of what the best free shape explains that the name explains.
        grades: how sure it is.
        remainder: whether it is too small beside what was found first to be more than a rest of it.
    """

    found: Round
    chosen: Tried | None
    share: float = 1.0
    grades: Grades = NO_GRADES
    remainder: bool = False

    @property
    def tried(self) -> tuple[Tried, ...]:
        """Names and free shapes."""
        return (*self.found.names, *self.found.shapes)

    @property
    def named(self) -> bool:
        """Whether it has a name."""
        return self.chosen is not None and self.chosen.candidate.effect is not None


def decided(found: Round, criteria: Criteria) -> Choice:
    """Choose among what a round tried by the rule, see `rule.chosen`.

    Args:
        found: the round.
        criteria: of the decision.
    """
    told = chosen([_entrant(t) for t in (*found.names, *found.shapes)], criteria)
    names, shapes = (
        tuple(_weighted(t, told.weights.get(t.candidate.id, 0.0)) for t in group)
        for group in (found.names, found.shapes)
    )
    found = replace(found, names=names, shapes=shapes)
    if told.chosen is None:
        return Choice(found, None)
    taken = next(t for t in (*names, *shapes) if t.candidate.id == told.chosen.id)
    return Choice(found, taken, told.share, told.grades)


def _entrant(tried: Tried) -> Entrant:
    candidate = tried.candidate
    named = candidate.effect is not None
    # Numbers of a free shape are bounded by what is known of them.
    inside = not any(f.candidates[-1].at_end(f.numbers[-1]) for f in tried.fits)
    common = candidate.effect is not None and candidate.effect.common
    return Entrant(
        candidate.id, candidate.component, candidate.depends_on, named, common, inside, tried.row
    )


def explained(
    folds: Sequence[Fold], candidates: Sequence[Candidate], criteria: Criteria, most: int,
    report: Report,
) -> tuple[list[Choice], tuple[Fit, ...]]:  # fmt: skip
    """Look for one thing after another that is missing.

    Args:
        folds: what is fitted and what judges.
        candidates: on offer.
        criteria: of the decision.
        most: things that are looked for.
        report: told what is done next, see `Report`.

    Returns:
        A choice for each round, the last of which may have found nothing, and the fits with all
        that was taken.
    """
    report("fitting the rig alone")
    here = tuple(fit(f.setting, f.setting.centre) for f in folds)
    choices: list[Choice] = []
    while len(choices) < most:
        if choices and report("looking for more"):
            break
        taken = {c.chosen.candidate.id for c in choices if c.chosen is not None}
        offered = [c for c in candidates if c.id not in taken]
        choice = decided(searched(folds, here, offered, report), criteria)
        first = choices[0].chosen if choices else None
        if choice.chosen is not None and first is not None:
            small = choice.chosen.row.gain < criteria.neighbour * first.row.gain
            # What a free shape adds to a name is how its law differs.
            choice = replace(choice, remainder=small or not choice.named)
        choices.append(choice)
        if choice.chosen is None or choice.remainder:
            break
        here = choice.chosen.fits
        if not choice.named:
            break
    return choices, here


def _weighted(tried: Tried, weight: float) -> Tried:
    return replace(tried, row=replace(tried.row, weight=weight))
