"""The decision: what is missing, how finely it can be told, and what else it may be."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from drill_env._watch import Report
from drill_env.prediction.candidate import Candidate
from drill_env.prediction.compare import listed
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.fit import Fit, fit
from drill_env.prediction.noise import is_noise
from drill_env.prediction.rule import NO_GRADES, Entrant, Grades, chosen
from drill_env.prediction.search import Fold, Round, Tried, begun_anew, searched, without_first

# False alarms that are accepted, as in `Criteria.evidence` and `Criteria.z`.
_CHANCE = 0.05


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


@dataclass(frozen=True, slots=True, eq=False)
class Explained:
    """What a search came to.

    Attributes:
        choices: one for each thing that was found; the last may have found nothing.
        alone: the rig without them, fitted.
        fits: with all that was taken, one for each fold.
        folds: with windows that begin where these fits predict best from.
    """

    choices: list[Choice]
    alone: Fit
    fits: tuple[Fit, ...]
    folds: tuple[Fold, ...]

    @property
    def told(self) -> bool:
        """Whether something is missing."""
        return any(c.chosen is not None for c in self.choices)


def beyond_chance(tried: int, criteria: Criteria) -> float:
    """Gain, nats, that none of the candidates of a search at all horizons comes to by chance.

    That the unseen are so many times likelier under a wrong model has no larger probability than
    one over that many (Ville; Gruenwald, de Heide and Koolen, JRSS B 86, 2024). So of all that are
    tried one search in twenty is wrong beyond what predicts alike.

    Args:
        tried: candidates that are judged.
        criteria: of the decision.
    """
    return criteria.gain + math.log(max(tried, 1) * len(criteria.horizons) / _CHANCE)


def decided(found: Round, criteria: Criteria) -> Choice:
    """Choose among what a round tried by the rule, see `rule.chosen`.

    Args:
        found: the round.
        criteria: of the decision.
    """
    entrants = [_entrant(t) for t in (*found.names, *found.shapes)]
    told = chosen(entrants, replace(criteria, gain=beyond_chance(len(entrants), criteria)))
    names, shapes = (
        tuple(_weighted(t, told.weights.get(t.candidate.id, 0.0)) for t in group)
        for group in (found.names, found.shapes)
    )
    found = replace(found, names=names, shapes=shapes)
    # Beside a first name a second one is none before its rivals were tried.
    early = not found.complete and any(fit.candidates for fit in found.before)
    if told.chosen is None or early:
        return Choice(found, None)
    taken = next(t for t in (*names, *shapes) if t.candidate.id == told.chosen.id)
    return Choice(found, taken, told.share, told.grades)


def _entrant(tried: Tried) -> Entrant:
    candidate = tried.candidate
    named = candidate.effect is not None
    # Numbers of a free shape are bounded by what is known of them.
    inside = not named or not any(f.candidates[-1].at_end(f.numbers[-1]) for f in tried.fits)
    common = candidate.effect is not None and candidate.effect.common
    return Entrant(
        candidate.id, candidate.component, candidate.depends_on, named, common, inside, tried.row
    )


def explained(
    folds: Sequence[Fold], candidates: Sequence[Candidate], criteria: Criteria, most: int,
    report: Report,
) -> Explained:  # fmt: skip
    """Look for one thing after another that is missing.

    Args:
        folds: what is fitted and what judges.
        candidates: on offer.
        criteria: of the decision.
        most: things that are looked for.
        report: told what is done next, see `Report`.
    """
    report("fitting the rig alone")
    folds, here = begun_anew(folds, tuple(fit(f.setting, f.setting.centre) for f in folds))
    alone, choices, taken = here[0], list[Choice](), set[str]()
    if is_noise([(b, f.unseen) for b, f in zip(here, folds, strict=True)]):
        return Explained(choices, alone, here, folds)
    while len(choices) < most:
        if choices and report("looking for more"):
            break
        offered = [c for c in candidates if c.id not in taken]
        choice = decided(searched(folds, here, offered, report), criteria)
        first_of_many = not choices and most > 1
        pair = _pair_for(choice, folds, offered, criteria, report) if first_of_many else None
        if pair is not None:
            choices, folds, here = pair
            taken |= _ids(choices)
            continue
        first = choices[0].chosen if choices else None
        if choice.chosen is not None and first is not None:
            least = least_share(choice.chosen.candidate, choices, criteria) * first.row.gain
            small = choice.chosen.row.gain < least
            # What a free shape adds to a name is how its law differs.
            choice = replace(choice, remainder=small or not choice.named)
        choices.append(choice)
        if choice.chosen is None or choice.remainder:
            break
        folds, here = begun_anew(folds, choice.chosen.fits)
        if not choice.named:
            break
        taken |= _ids(choices)
        if len(choices) > 1 and not report("choosing each beside the others"):
            choices, here = _again(folds, choices, here, criteria, report)
            # What was taken before or is now is offered no more, or a search could go round.
            taken |= _ids(choices)
    return Explained(choices, alone, here, folds)


def least_share(own: Candidate, choices: Sequence[Choice], criteria: Criteria) -> float:
    """Of the first gain, what a further name must bring to be no rest of what was found.

    Two functions of one coordinate at one place are one curve, for which a name stands from
    `Criteria.share` of it. What most machines have is a cause of its own.

    Args:
        own: the further candidate.
        choices: of the rounds before.
        criteria: of the decision.
    """
    for other in (c.chosen.candidate for c in choices if c.chosen is not None):
        common = any(c.effect is not None and c.effect.common for c in (own, other))
        same = (own.component, own.depends_on) == (other.component, other.depends_on)
        if same and not common:
            return 1.0 - criteria.share
    return criteria.neighbour


def _ids(choices: Sequence[Choice]) -> set[str]:
    return {c.chosen.candidate.id for c in choices if c.chosen is not None}


def _pair_for(
    choice: Choice, folds: Sequence[Fold], offered: Sequence[Candidate], criteria: Criteria,
    report: Report,
) -> tuple[list[Choice], tuple[Fold, ...], tuple[Fit, ...]] | None:  # fmt: skip
    """A name that most machines have and a second one in place of a curve, if they explain it.

    A curve over a coordinate is the sum of all laws over it. What is common is looked for first,
    clear or not while the other is missing; both have to be clear beside each other, and explain
    together what a name must of a curve.
    """
    curve = choice.chosen
    if curve is None or choice.named:
        return None
    usual = [
        t
        for t in choice.found.names
        if t.candidate.effect is not None
        and t.candidate.effect.common
        and t.candidate.component == curve.candidate.component
        and t.row.gain >= criteria.gain
    ]
    if not usual or report("looking beside what most machines have"):
        return None
    first = max(usual, key=lambda t: t.row.gain)
    folds, here = begun_anew(folds, first.fits)
    others = [c for c in offered if c.id != first.candidate.id]
    second = decided(searched(folds, here, others, report), criteria)
    if second.chosen is None or not second.named:
        return None
    folds, here = begun_anew(folds, second.chosen.fits)
    both, here = _again(folds, [replace(choice, chosen=first), second], here, criteria, report)
    told = [c.chosen.row.gain for c in both if c.chosen is not None]
    if len(told) < 2 or sum(told) < criteria.share * curve.row.gain:
        return None
    return both, folds, here


def _again(
    folds: Sequence[Fold], choices: Sequence[Choice], here: Sequence[Fit], criteria: Criteria,
    report: Report,
) -> tuple[list[Choice], tuple[Fit, ...]]:  # fmt: skip
    """Choose each of several effects once more, beside the others.

    What was found first was judged while the rest was missing, and may have stood in for it; so
    may what was not clear then be clear now. Shapes that were listed are there for the names that
    stand for them, and take the place of none.
    """
    kept: list[Choice] = []
    begun = tuple(here)
    for choice in choices:
        fewer = without_first(here)
        beside = {c.id for c in fewer[0].candidates}
        worth = [t for t in choice.found.names if t.row.gain >= criteria.gain]
        worth += [t for t in choice.found.shapes if listed(t.row, criteria)]
        rivals = [t.candidate for t in worth if t.candidate.id not in beside]
        found = searched(folds, fewer, rivals, report)
        if not found.complete:
            return list(choices), begun
        choice = decided(found, criteria)
        if not choice.named:
            choice = decided(replace(found, shapes=()), criteria)
        # What is taken comes last among the fits, so that once round all stand in their order.
        here = choice.found.before if choice.chosen is None else choice.chosen.fits
        kept += [] if choice.chosen is None else [choice]
    return kept, tuple(here)


def _weighted(tried: Tried, weight: float) -> Tried:
    return replace(tried, row=replace(tried.row, weight=weight))
