"""A last fit of effects at the filter's own state, where a smoothed motion misleads."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from drill_env._types import FloatArray
from drill_env._watch import Report
from drill_env.diagnosis.extended import evaluate
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.joint import LAST_ROUNDS, WORTH_A_ROUND, descend_jointly, polished
from drill_env.diagnosis.profiles import interval_ends
from drill_env.diagnosis.terms import Named, Term, at_rest
from drill_env.effects import Effect
from drill_env.identification.coordinates import inverse

_PROBINGS = 2
# Most descents from one better fit to the next, a bound on the work: eight opened cases needed
# three at most.
_DESCENTS = 6
# Shares of a number: by less rounding shows, by more the formula bends.
_NEAREST, _FURTHEST = 1e-4, 0.05


def within_filter(setting: Setting, fit: Fit, report: Report = lambda text: None) -> Fit:
    """The fit with its effects at the filter's own state where their numbers need that.

    A drive's torque follows from when the disc is released and held, which the smoothed motion
    blurs; a search that took every candidate within the filter would cost twice the time.

    Args:
        setting: recordings and free parameters.
        fit: what the search came to.
        report: told what is being done.
    """
    inside = moved_in(setting, fit)
    if inside is not fit:
        if not math.isfinite(inside.value):
            # The filter breaks down with the numbers that the motion told: these are all there is.
            return fit
        report("fitting within the filter")
        fit = polished(setting, probed(setting, inside))
    if not any(at_rest(term) for term in fit.terms):
        return fit
    # Slopes over short steps see the jumps: by those a descent ends before its peak.
    return _profiled(setting, probed(setting, fit))


def _profiled(setting: Setting, fit: Fit) -> Fit:
    """The fit carried on until no number's profile leads on, with the ends that these tell."""
    for _ in range(_DESCENTS):
        there = descend_jointly(setting, fit, limit=LAST_ROUNDS, enough=WORTH_A_ROUND)
        fit = probed(setting, there)
        ends, better = interval_ends(setting, fit)
        if better is None:
            return replace(fit, ends=ends)
        fit = better
        if setting.over():
            break
    return fit


def moved_in(setting: Setting, fit: Fit) -> Fit:
    """The same numbers with effects at the filter's own state; the fit itself where none is.

    A gear always, since along a smoothed motion its numbers come out wrong. All others where the
    recordings are more likely so: along that motion a friction has no say in when a disc rests, and
    what swings by itself is lost in smoothing.
    """
    inside = _within(setting, fit, lambda effect: effect.refined_within)
    every = _within(setting, inside, lambda effect: not effect.senses and not effect.delay)
    return every if every.value < inside.value else inside


def _within(setting: Setting, fit: Fit, which: Callable[[Effect], bool]) -> Fit:
    terms = tuple(
        Term(replace(t.source, within=True), t.q)
        if type(t.source) is Named and which(t.source.effect) and not at_rest(t)
        else t
        for t in fit.terms
    )
    if terms == fit.terms:
        return fit
    return evaluate(setting, fit.vector, terms, fit.noise, fit.starts, fit.motions)


def probed(setting: Setting, fit: Fit) -> Fit:
    """The fit with slopes of such effects over steps as long as their numbers are uncertain.

    Where discs are released and held, predictions jump: over a short step they seem to tell a
    number to many digits that they do not tell.
    """
    for _ in range(_PROBINGS):
        deviation = np.sqrt(np.maximum(np.diag(inverse(fit.information)), 0.0))
        terms, place = [], len(fit.vector)
        for term in fit.terms:
            terms.append(_with_steps(term, deviation[place : place + len(term.q)]))
            place += len(term.q)
        there = evaluate(setting, fit.vector, tuple(terms), fit.noise, fit.starts, fit.motions)
        if not math.isfinite(there.value):
            return fit
        fit = there
    return fit


def _with_steps(term: Term, deviation: FloatArray) -> Term:
    source = term.source
    if not isinstance(source, Named) or not at_rest(term):
        return term
    usual = 1e4 * source.steps(term.q)
    steps = np.clip(deviation, _NEAREST * usual, _FURTHEST * usual)
    return Term(replace(source, probe=tuple(steps.tolist())), term.q)
