"""The decision on a whole rig: evidence of all recordings for what the search tried.

The evidence of a model is the probability of all recordings under it. By the rule of the chain it
is that of the fitted ones, which the information criterion approximates (Schwarz, Annals of
Statistics 6, 1978), times that of the held-out ones, each reading predicted from those before it by
the filter with the numbers that were fitted (Dawid, Journal of the Royal Statistical Society A 147,
1984).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.block_densities import HeldOut
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.in_filter import within_filter
from drill_env.diagnosis.intervals import sized
from drill_env.diagnosis.joint import polished
from drill_env.diagnosis.lost_counts import LostCounts
from drill_env.diagnosis.probability import UNLISTED
from drill_env.diagnosis.rivals import best_without
from drill_env.diagnosis.rounds import Attempt, Found, Round, at_range_end, is_named, place_of
from drill_env.diagnosis.strikes import Once
from drill_env.diagnosis.terms import Named, Term
from drill_env.identification.samples import Samples
from drill_env.prediction.compare import Row, standard_error, z_of
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.rule import Choice, Entrant, chosen

# Times the evidence that fitted recordings must show for what those held out contradict to be more
# than a trace.
_ASKED = 2.0
# Components whose torques are on the upper disc.
_UPPER = ("actuator", "upper")
# Attempts that are judged.
_NAMES, _SHAPES = 5, 3


@dataclass(frozen=True, slots=True, eq=False)
class Weighed:
    """The attempts of one round by their evidence.

    Attributes:
        choice: what the rule takes.
        entrants: what was judged.
        attempts: the fits of these, by their ids.
    """

    choice: Choice
    entrants: tuple[Entrant, ...]
    attempts: dict[str, Attempt]

    @property
    def taken(self) -> Attempt | None:
        """The fit that the rule takes."""
        return None if self.choice.chosen is None else self.attempts[self.choice.chosen.id]

    @property
    def whole(self) -> float:
        """Evidence of what the rule takes, nats."""
        return 0.0 if self.choice.chosen is None else self.choice.chosen.row.gain

    def restated(self, found: Round) -> Round:
        """A round with its attempts' probabilities, and their evidence in the criterion's units.

        Those are twice as large. What is not listed has none.
        """
        listed = self.choice.weights
        told = {
            e.id: 2.0 * (e.row.gain if e.id in listed else min(e.row.gain, 0.0))
            for e in self.entrants
        }

        def again(attempts: Sequence[Attempt]) -> tuple[Attempt, ...]:
            moved = [replace(a, criterion=told.get(a.term.id, a.criterion)) for a in attempts]
            return tuple(sorted(moved, key=lambda a: -a.criterion))

        return replace(
            found, named=again(found.named), shapes=again(found.shapes), weights=dict(listed)
        )


def decided(
    found: Found, held: Sequence[Samples], criteria: Criteria
) -> tuple[Found, Weighed | None]:
    """What was found, after all recordings were asked, and the table of the first round.

    Args:
        found: the search.
        held: recordings that were not fitted; without them the fitted ones decide.
        criteria: of the decision.
    """
    if not found.rounds or not (found.rounds[0].named or found.rounds[0].shapes):
        return found, None
    unseen = HeldOut(held, found.setting, criteria.degrees)
    if any(_once(a.term) for a in found.rounds[0].named[:1]):
        # Which counts will be lost in other recordings, lost counts do not tell.
        unseen = replace(unseen, samples=())
    judge = _Judge(found.setting, unseen, criteria)
    table = judge.weighed(found.rounds[0])
    taken = table.taken
    if taken is None:
        return _contradicted(found, found.final, criteria), table
    first, later = table.restated(found.rounds[0]), found.rounds[1:]
    if not is_named(taken.term):
        final = polished(found.setting, taken.fit)
        return replace(found, rounds=(first, *later), final=final), table
    found = replace(found, rounds=(first, *(judge.asked_beside(r, found) for r in later)))
    final = judge.climbed(found, taken, table)
    if final.terms[0].id != taken.term.id:
        # Beside another name it is by far more probable than what was taken alone.
        first = replace(first, weights={final.terms[0].id: 1.0})
        found = replace(found, rounds=(first, *found.rounds[1:]))
    if not judge.borne(found.base, final):
        return _contradicted(found, final, criteria), table
    if any(at_range_end(term) for term in final.terms):
        refuted = _contradicted(found, final, criteria)
        return replace(refuted, reason="a number came to the end of its range"), table
    return replace(found, final=final if judge.has_size(final, 0) else found.base), table


def listing(criteria: Criteria) -> Criteria:
    """The criteria with the evidence that a whole rig asks for in place of that of one window."""
    return replace(criteria, gain=criteria.evidence)


def _contradicted(found: Found, final: Fit, criteria: Criteria) -> Found:
    """The rig alone; names that fitted recordings ask for by more than a trace are refuted."""
    told = 0.5 * (found.base.bic - final.bic)
    refuted = final if told > _ASKED * criteria.evidence else None
    return replace(found, final=found.base, refuted=refuted)


def _improbable(found: Found, name: str) -> bool:
    """Whether a name is less probable than physics of no library in each round that weighed it."""
    weighed = [r for r in found.rounds[1:] if r.weights]
    later = [r for r in weighed if any(a.term.id == name for a in r.named)]
    return bool(later) and max(r.weights.get(name, 0.0) for r in later) < UNLISTED


def _once(term: Term) -> bool:
    return isinstance(term.source, (LostCounts, Once))


@dataclass(frozen=True, slots=True, eq=False)
class _Judge:
    """Evidence of fits, of held-out recordings by block.

    Attributes:
        setting: of the fits.
        held: recordings that were not fitted.
        criteria: of the decision.
    """

    setting: Setting
    held: HeldOut
    criteria: Criteria

    def weighed(self, found: Round) -> Weighed:
        """A round's attempts.

        A shape where an earlier name acts is the difference of that name's law, and no rival.
        """
        taken = [place_of(term)[0] for term in found.before.terms]
        shapes = [a for a in found.shapes if place_of(a.term)[0] not in taken]
        entrants, attempts = [], {}
        for attempt in (*found.named[:_NAMES], *shapes[:_SHAPES]):
            attempts.setdefault(attempt.term.id, attempt)
        fits = [a.fit for a in attempts.values() if not _once(a.term)]
        self.held.ask((found.before, *fits))
        for attempt in attempts.values():
            row, stands = self.row(attempt, found.before)
            component, depends_on = place_of(attempt.term)
            source = attempt.term.source
            common = isinstance(source, Named) and source.effect.common
            entrants.append(
                Entrant(
                    attempt.term.id, component, depends_on, is_named(attempt.term), common,
                    stands, row,
                )
            )  # fmt: skip
        return Weighed(chosen(entrants, listing(self.criteria)), tuple(entrants), attempts)

    def asked_beside(self, later: Round, found: Found) -> Round:
        """A later round with the probabilities of its attempts, if a name of it may be told."""
        fits = (*(r.before for r in found.rounds), found.final)
        before = {term.id for term in later.before.terms}
        told = {term.id for fit in fits for term in fit.terms} - before
        if not any(a.term.id in told for a in later.named):
            return later
        return self.weighed(later).restated(later)

    def row(self, attempt: Attempt, before: Fit) -> tuple[Row, bool]:
        """One attempt, and whether it is determined and held-out recordings bear it."""
        once = _once(attempt.term)
        gains = np.zeros(0) if once else self.held.blocks(attempt.fit) - self.held.blocks(before)
        return self.compared(attempt.term, 0.5 * attempt.criterion, gains)

    def compared(self, term: Term, told: float, gains: FloatArray) -> tuple[Row, bool]:
        """A term by its evidence, and whether it is determined and held-out recordings bear it.

        Args:
            term: what is judged.
            told: evidence of the fitted recordings for it, nats.
            gains: that of each block of the held-out ones, nats; none of what happened once,
                which tells nothing of other recordings.
        """
        unseen = float(gains.sum())
        error = standard_error(gains, self.held.marks()) if len(gains) else 0.0
        gain, count = told + unseen, max(len(self.held.marks()), 1)
        each = (gains if len(gains) else np.zeros(count)) + told / count
        # One block alone has no scatter.
        scatter = 0.0 < error < math.inf
        z = z_of(each, self.held.marks()) if scatter else math.copysign(math.inf, gain)
        error = error if scatter else 0.0
        row = Row(
            term.id, gain, error, z, (told, unseen), len(term.q), each,
            recordings=tuple(self.held.marks()),
        )  # fmt: skip
        # What scatter may do is no contradiction of a name; a free shape, which fits what it will,
        # has to predict others better. But what those that it was fitted to do not ask for at all
        # is nothing that others could bear out.
        least = -self.criteria.z * error if scatter else -self.criteria.gain
        if len(gains) and not is_named(term):
            least = self.criteria.gain
        borne = unseen > least and told > 0.0
        return row, borne and not at_range_end(term)

    def climbed(self, found: Found, taken: Attempt, table: Weighed) -> Fit:
        """The name that was taken with what stands beside it, carried on within the filter."""
        steps = [r.later or r.before for r in found.rounds[1:]] + [found.final]
        same = [s for s in steps if [t.id for t in s.terms] == [taken.term.id]]
        here = min(same, key=lambda s: s.bic, default=None) or polished(self.setting, taken.fit)
        here = self._carried_on(here, found)
        for step in steps:
            longer = len(step.terms) > len(here.terms)
            if longer and not _improbable(found, step.terms[-1].id):
                # What the first name gains there is no gain of the second.
                there = self._carried_on(step, found)
                here = there if self.earned(here, there, table.whole) else here
        return here

    def _carried_on(self, fit: Fit, found: Found) -> Fit:
        """The fit within the filter; that is where the search left what it ended with."""
        return fit if fit is found.final else within_filter(self.setting, fit)

    def earned(self, here: Fit, step: Fit, whole: float) -> bool:
        """Whether one more term is listed beside those before it, as the first one is.

        Args:
            here: a fit.
            step: one with more terms.
            whole: evidence for the first of them, nats.
        """
        if any(at_range_end(term) for term in step.terms):
            # Beside a name that takes its place an earlier one is not determined any more.
            return False
        last = step.terms[-1]
        gains = np.zeros(0) if _once(last) else self.held.blocks(step) - self.held.blocks(here)
        row, stands = self.compared(last, 0.5 * (here.bic - step.bic), gains)
        least = self.criteria.evidence
        if last.id not in [t.id for t in here.terms]:
            least = max(least, self._share(here, last) * whole)
        if not (stands and row.z >= self.criteria.z and row.gain > least):
            return False
        return self.has_size(step, len(step.terms) - 1)

    def has_size(self, fit: Fit, place: int) -> bool:
        """Whether a term is there: by its size's deviation or else by the best fit without it."""
        if sized(fit, fit.terms[place]):
            return True
        fewer = best_without(self.setting, fit, place)
        return 0.5 * (fewer.bic - fit.bic) > self.criteria.evidence

    def borne(self, base: Fit, final: Fit) -> bool:
        """Whether unseen readings are more probable with all names than under the rig alone.

        While a second effect is missing, one name alone may make them less so.
        """
        if not self.held.samples or all(_once(term) for term in final.terms):
            return True
        return bool(np.sum(self.held.blocks(final) - self.held.blocks(base)) > 0.0)

    def _share(self, here: Fit, last: Term) -> float:
        """Of the first term's evidence, that a further one must bring to be no remainder of it.

        At one place, what a name leaves is up to that share its own law's, see `Criteria.share`;
        so it is of a torque of one coordinate on one disc, whether made by the drive or beside it.
        Of what happened once, held-out recordings tell nothing.
        """
        component, on = place_of(last)
        same = [place_of(t) for t in here.terms]
        if any(place == component for place, _ in same) or (
            component in _UPPER and any(place in _UPPER and by == on for place, by in same)
        ):
            return 1.0 - self.criteria.share
        return self.criteria.neighbour if _once(last) else 0.0
