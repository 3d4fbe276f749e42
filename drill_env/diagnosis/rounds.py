"""What a search leaves: attempts, rounds, and what it came to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.lost_counts import LostCounts
from drill_env.diagnosis.repetition import Repetition
from drill_env.diagnosis.residual_torque import ResidualTorque
from drill_env.diagnosis.scan import Scored
from drill_env.diagnosis.terms import Named, Term
from drill_env.diagnosis.waves import Wave

NEEDED = 20.0
"""Gain of the information criterion at which an effect is as likely as none."""

BELIEVED = 30.0
"""Gain below which nothing is believed in: a trace of what no library has is told as another."""

NEEDED_BESIDE = 40.0
"""The same beside another effect, whose formula need not be the rig's to the last digit."""

_AT_LIMIT = 1.5
# Share of a range's end within which a number is there.
_END = 1e-3
# Recordings: within one it changes by an eighth, or less.
_SLOW = 8.0
# And share of one before which a change is as good as at its start.
_EARLY = 0.01

# By this share more must a free shape explain before a name gives way to it.
_NAMELESS = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class Attempt:
    """A candidate fitted together with the rig and the noise.

    Attributes:
        fit: the fit with it.
        term: the candidate in it.
        gain: fall of minus twice the log likelihood against the fit without it.
        criterion: the same less the price of its numbers.
        settled: whether its descent came to its end.
    """

    fit: Fit
    term: Term
    gain: float
    criterion: float
    settled: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Round:
    """One search at one fit.

    Attributes:
        before: the fit that was searched.
        scores: of all effects and shapes, before any was fitted.
        named: attempts with effects, best first.
        shapes: attempts with free shapes, best first.
        weights: probability of each attempt that all recordings ask for, once they were asked.
        later: the same terms as before, carried on as far as what was found beside them.
        complete: whether all that had promise was tried before the time was over.
    """

    before: Fit
    scores: tuple[Scored, ...]
    named: tuple[Attempt, ...]
    shapes: tuple[Attempt, ...]
    weights: dict[str, float] = field(default_factory=dict)
    later: Fit | None = None
    complete: bool = True

    @property
    def best(self) -> Attempt | None:
        """The best of all."""
        both = sorted((*self.named, *self.shapes), key=lambda a: -a.criterion)
        return both[0] if both else None


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """What a search came to.

    Attributes:
        setting: recordings and free parameters.
        base: the rig alone, fitted.
        rounds: one for each effect that was looked for.
        final: the fit with all that is believed in.
        refuted: a fit with names that were rejected, if any.
        reason: why they were.
        explained: share of the error of unseen predictions that what was found takes away.
        follows: whether unseen recordings follow the rig at all, with what was found or alone.
        residual_torque: how much of the final fit's the motion predicts.
        residual_shape: the shape of that where nothing that was found accounts for it.
        repetition: what of it repeats in time, at a phase of its own in each recording.
        one_law: of each name that only completes the law of another one, that one's.
    """

    setting: Setting
    base: Fit
    rounds: tuple[Round, ...]
    final: Fit
    refuted: Fit | None = None
    reason: str = "held-out recordings do not bear it out"
    explained: float = 1.0
    follows: bool = True
    residual_torque: ResidualTorque | None = None
    residual_shape: Term | None = None
    repetition: Repetition | None = None
    one_law: dict[str, str] = field(default_factory=dict)

    @property
    def rejected(self) -> tuple[str, ...]:
        """The names that were refuted."""
        return () if self.refuted is None else tuple(term.id for term in self.refuted.terms)


def clearly(gain: float) -> float:
    """By how much more a free shape must explain than a name that explains this much."""
    return max(NEEDED, _NAMELESS * abs(gain))


def is_named(term: Term) -> bool:
    """Whether a term stands for an effect of the library."""
    return isinstance(term.source, (Named, LostCounts)) and not isinstance(term.source, Wave)


def nameless(found: Round) -> bool:
    """Whether a free shape explains clearly more than any name."""
    return shape_leads((*found.named, *found.shapes))


def shape_leads(done: Sequence[Attempt]) -> bool:
    """Whether the best of the free shapes explains clearly more than the best of the names."""
    shape = max((a.criterion for a in done if not is_named(a.term)), default=0.0)
    name = max((a.criterion for a in done if is_named(a.term)), default=0.0)
    return shape > NEEDED and shape > name + clearly(name)


def outdone(found: Found, name: str, share: float) -> bool:
    """Whether a search tried a name, and it explains less than a share of what was taken there.

    Args:
        found: the search, decided.
        name: id of the effect.
        share: see `Criteria.share`.
    """
    if not found.rounds or not found.final.terms:
        return False
    first, taken = found.rounds[0], found.final.terms[0].id
    told = {a.term.id: a.criterion for a in (*first.shapes, *first.named)}
    return name in told and taken in told and told[name] < share * told[taken]


def place_of(term: Term) -> tuple[str, str]:
    """Where a term acts: component and coordinate."""
    source = term.source.effect if isinstance(term.source, Named) else term.source
    return source.component, source.depends_on


def at_its_limit(attempt: Attempt, others: Sequence[Attempt]) -> bool:
    """Whether a candidate came to where it is another one that was fitted too, or the rig's own.

    The rig's own parameters are held near the start; what is one of them again is not.
    """
    source = attempt.term.source
    if not isinstance(source, Named):
        return False
    if source.effect.rigs_own_if_slow:
        return bool(attempt.term.q[-1] > _SLOW * _longest(attempt))
    if source.effect.rigs_own_if_early:
        return bool(attempt.term.q[-1] < _EARLY * _longest(attempt))
    other = limit_reached(attempt.term)
    return other is not None and any(a.term.id == other for a in others)


def limit_reached(term: Term) -> str | None:
    """The effect that a term is in the limit of its numbers, if they came there."""
    if not isinstance(term.source, Named) or term.source.effect.limit is None:
        return None
    name, other = term.source.effect.limit
    place = [p.name for p in term.source.effect.parameters].index(name)
    least = term.source.effect.parameters[place].low
    return other if term.q[place] <= _AT_LIMIT * least else None


def at_range_end(term: Term) -> bool:
    """Whether a number came to the end of its range, so that it is not determined.

    The least of what may be none, 0, is no such end, nor is that of a ratio or the most of a share:
    there physics ends and not the search.
    """
    if not isinstance(term.source, Named):
        return False
    pairs = zip(term.source.effect.parameters, term.q.tolist(), strict=True)
    told = [(p, value) for p, value in pairs if p.role == "shape"]
    least = any(0.0 < p.low >= (1.0 - _END) * v for p, v in told if p.unit != "1")
    most = (v >= (1.0 - _END) * p.high for p, v in told if not p.name.endswith("share"))
    return least or any(most)


def _longest(attempt: Attempt) -> float:
    return max(float(m.t[-1] - m.t[0]) for m in attempt.fit.motions)
