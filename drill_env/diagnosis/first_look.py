"""First look at a candidate: from its linear score to a fit from which a descent can start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.fit_changes import added, gain_of, own_values
from drill_env.diagnosis.joint import joint_step, overreaches
from drill_env.diagnosis.scan import Scored
from drill_env.diagnosis.terms import Named, Shape, Term

# Share of the score that the scored size must gain to be believed.
_TRUE_SCORE = 0.3
_STEPS = 3
# Factors by which effects without an amplitude are tried stronger and weaker.
_CLIMBS = (2.0, 1.3)


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """What a first look at a candidate saw.

    Attributes:
        gain: fall of minus twice the log likelihood.
        term: the candidate.
        fit: with it, where one was made.
    """

    gain: float
    term: Term
    fit: Fit | None = None

    def start(self, setting: Setting, before: Fit) -> Fit:
        """The fit from which a descent starts; it is made here if it was not before."""
        return self.fit or added(setting, before, self.term)


def first_look(
    setting: Setting, fit: Fit, scored: Scored, own: Sequence[float] | None = None
) -> Look:
    """A candidate at its scored size, or where one joint step from none of it leads.

    Linear scores overreach: a torque that the rig's parameters would take back in part does harm
    while they stay where they are.

    Args:
        setting: recordings and free parameters.
        fit: without the candidate.
        scored: the candidate.
        own: of `own_values`, where many candidates are looked at.
    """
    own = own or own_values(setting, fit)
    if _sizeless(scored.term):
        return _sizeless_look(setting, fit, scored.term, own)
    gain, term = gain_of(setting, fit, scored.term, own), scored.term
    if gain > _TRUE_SCORE * scored.gain:
        return Look(gain, term)
    start = added(setting, fit, Term(term.source, _sized(term, 0.0)))
    # As far as usual sizes reach, and as far as the score does: it may be true.
    ways = (False, True) if overreaches(setting, start, 1e-4) else (False,)
    looks = [joint_step(setting, start, 1e-4, tries=_STEPS, far=far)[0] for far in ways]
    return _best(fit, looks)


def _best(fit: Fit, looks: Sequence[Fit]) -> Look:
    there = min(looks, key=lambda look: look.value)
    return Look(fit.value - there.value, there.terms[-1], there)


def _sizeless_look(setting: Setting, fit: Fit, term: Term, own: Sequence[float]) -> Look:
    """The better of the scored size, which the rig would follow, and of the climbed one."""
    gain, climbed = _climbed(setting, fit, term, own)
    if gain > 0.0 and np.array_equal(climbed.q, term.q):
        return Look(gain, climbed)
    start = added(setting, fit, term)
    stepped = joint_step(setting, start, 1e-4, tries=_STEPS)[0]
    return _best(fit, [added(setting, fit, climbed), stepped])


def _sizeless(term: Term) -> bool:
    """Whether no number of a term makes it vanish in proportion."""
    if not isinstance(term.source, Named):
        return False
    return all(p.role != "amplitude" for p in term.source.effect.parameters)


def _climbed(setting: Setting, fit: Fit, term: Term, own: Sequence[float]) -> tuple[float, Term]:
    """The size of an effect without an amplitude, where the likelihood itself is best.

    Its score stands for one size only; another may be better by far.
    """
    best = gain_of(setting, fit, term, own)
    for factor in _CLIMBS:
        for place in range(len(term.q)):
            for way in (1.0 / factor, factor):
                before = best
                best, term = _uphill(setting, fit, term, own, best, place, way)
                if best > before:
                    break
    return best, term


def _uphill(
    setting: Setting,
    fit: Fit,
    term: Term,
    own: Sequence[float],
    best: float,
    place: int,
    way: float,
) -> tuple[float, Term]:
    """One number of a term multiplied again and again while the likelihood grows."""
    assert isinstance(term.source, Named)
    while True:
        q = term.q.copy()
        q[place] *= way
        tried = Term(term.source, term.source.bounded(q))
        if tried.q[place] == term.q[place]:
            return best, term
        gain = gain_of(setting, fit, tried, own)
        if gain <= best:
            return best, term
        best, term = gain, tried


def _sized(term: Term, share: float) -> FloatArray:
    if isinstance(term.source, Shape):
        return term.q * share
    roles = [p.role for p in term.source.effect.parameters]
    return np.where([role == "amplitude" for role in roles], share, 1.0) * term.q
