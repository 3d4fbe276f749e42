"""Search for what is missing: score every candidate, try the best, keep what the data demand."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.extended import (
    Fit,
    Setting,
    added,
    evaluate,
    gain_of,
    motion_of,
    with_new_motions,
    without,
)
from drill_env.diagnosis.ground import ground_at
from drill_env.diagnosis.joint import descend_jointly
from drill_env.diagnosis.scan import Scored, score_effects, score_shapes
from drill_env.diagnosis.shapes import free_shapes
from drill_env.diagnosis.slips import Slips, slips
from drill_env.diagnosis.terms import Named, Shape, Term
from drill_env.effects import Effect
from drill_env.identification.coordinates import Coordinates
from drill_env.identification.noise import NoiseModel
from drill_env.identification.prediction_error import Samples, path_of
from drill_env.parameters import Rig

NEEDED = 20.0
"""Gain of the information criterion below which an effect is not believed in."""

_RELEASE = 6.0
_WIDE, _WIDE_SHAPES = 12, 5
_TRIED, _TRIED_SHAPES = 6, 2
_SHARES = (1.0, 0.5, 0.2, 0.07)
_BASE_ROUNDS, _TRY_ROUNDS, _LAST_ROUNDS = 25, 6, 15
_FIRST_ROUNDS = 2
# Rounds more for candidates whose gain is not below this share of the best one's, and how many.
_HEATS = ((4, 0.3, 6), (10, 0.5, 3))
# By this share more must a free shape explain before a name gives way to it.
_NAMELESS = 0.15
# Scores fall short of the gain that a fit with its noise reaches.
_SLACK = 15.0

Report = Callable[[str], None]


@dataclass(frozen=True, slots=True, eq=False)
class Attempt:
    """A candidate fitted together with the rig and the noise.

    Attributes:
        fit: the fit with it.
        term: the candidate in it.
        gain: fall of minus twice the log likelihood against the fit without it.
        criterion: the same less the price of its numbers.
    """

    fit: Fit
    term: Term
    gain: float
    criterion: float


@dataclass(frozen=True, slots=True, eq=False)
class Round:
    """One search at one fit.

    Attributes:
        before: the fit that was searched.
        scores: of all effects and shapes, before any was fitted.
        named: attempts with effects, best first.
        shapes: attempts with free shapes, best first.
    """

    before: Fit
    scores: tuple[Scored, ...]
    named: tuple[Attempt, ...]
    shapes: tuple[Attempt, ...]

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
    """

    setting: Setting
    base: Fit
    rounds: tuple[Round, ...]
    final: Fit


def base_fit(
    samples: Sequence[Samples], rig: Rig, free: Sequence[str], doubt: float = 0.05
) -> tuple[Setting, Fit]:
    """Fit the rig alone, held near the start where it does not explain the recordings."""
    coordinates = Coordinates(rig, tuple(free))
    samples = [replace(s, release=_RELEASE) for s in samples]
    setting = Setting(tuple(samples), coordinates, doubt)
    noise = NoiseModel()
    for name, key in (("encoder_u", "theta_u"), ("encoder_l", "theta_l")):
        steps = [s.recording.quanta[key] for s in samples if key in s.recording.quanta]
        if steps:
            noise = replace(noise, **{name: max(steps) / np.sqrt(12.0)})
    motions = [motion_of(s, noise, path_of(s, rig, noise, s.starts)) for s in samples]
    # Weights would hold a filter back that starts with a wrong rig and too little noise.
    plain = replace(setting, robust=math.inf)
    here = evaluate(plain, coordinates.vector(rig), (), noise, [s.starts for s in samples], motions)
    here = descend_jointly(plain, here, limit=_BASE_ROUNDS, enough=1.0, sizes=False)
    return setting, with_new_motions(setting, here)


def search(setting: Setting, fit: Fit, effects: Sequence[Effect], report: Report) -> Round:
    """Look for one more effect at a fit.

    Args:
        setting: recordings and free parameters.
        fit: where to look.
        effects: the library.
        report: told what is being done.
    """
    report("scoring the library")
    ground = ground_at(setting, fit)
    present = {term.id for term in fit.terms}
    named = [s for s in score_effects(ground, effects) if s.term.id not in present]
    shapes = score_shapes(ground, free_shapes(fit.motions, fit.rig.inertias))
    price = np.log(fit.count)
    lost = [pair for pair in (slips(ground, 0), slips(ground, 1)) if pair is not None]
    hopeful = [
        s for s in (*named[:_WIDE], *shapes[:_WIDE_SHAPES]) if s.gain - s.numbers * price > -_SLACK
    ]
    hopeful += [Scored(term, gain) for term, gain in lost if gain - len(term.q) * price > 0.0]
    looked = sorted((_first_look(setting, fit, s) for s in hopeful), key=lambda pair: -pair[0])
    names = [t for _, t in looked if is_named(t)][:_TRIED]
    free = [t for _, t in looked if not is_named(t)][:_TRIED_SHAPES]
    done: list[Attempt] = []
    for term in (*names, *free):
        report(f"trying {term.id}")
        done.append(_attempt(setting, fit, added(setting, fit, term), _FIRST_ROUNDS))
    for rounds, hope, most in _HEATS:
        done.sort(key=lambda a: -a.gain)
        least = max(hope * done[0].gain, 5.0) if done else 0.0
        done = [
            _attempt(setting, fit, a.fit, rounds) if i < most and a.gain > least else a
            for i, a in enumerate(done)
        ]
    done.sort(key=lambda a: -a.criterion)
    return Round(
        fit, (*named, *shapes),
        tuple(a for a in done if is_named(a.term)),
        tuple(a for a in done if not is_named(a.term)),
    )  # fmt: skip


def _first_look(setting: Setting, fit: Fit, scored: Scored) -> tuple[float, Term]:
    """The first of the scored size and ever smaller ones that helps; linear scores overreach."""
    best = (-np.inf, scored.term)
    for share in _SHARES:
        term = Term(scored.term.source, _scaled(scored.term, share))
        gain = gain_of(setting, fit, term)
        if gain > best[0]:
            best = (gain, term)
        if best[0] > 0.3 * scored.gain or (best[0] > 0.0 and gain < best[0]):
            break
    return best


def _scaled(term: Term, share: float) -> FloatArray:
    if isinstance(term.source, Shape):
        return term.q * share
    roles = [p.role for p in term.source.effect.parameters]
    return np.where([role == "amplitude" for role in roles], share, 1.0) * term.q


def _attempt(setting: Setting, fit: Fit, start: Fit, rounds: int) -> Attempt:
    done = descend_jointly(setting, start, limit=rounds, enough=2.0)
    return Attempt(done, done.terms[-1], fit.value - done.value, fit.bic - done.bic)


def polished(setting: Setting, fit: Fit) -> Fit:
    """The fit carried on to its end, its motions told anew, all of the noise free."""
    for _ in range(3):
        before = fit.value
        fit = with_new_motions(setting, fit)
        fit = descend_jointly(setting, fit, limit=_LAST_ROUNDS, enough=0.5, sizes=False)
        if abs(before - fit.value) < 5.0:
            break
    return fit


def find(
    samples: Sequence[Samples], rig: Rig, free: Sequence[str], effects: Sequence[Effect],
    *, most: int = 2, doubt: float = 0.05, report: Report = lambda text: None,
) -> Found:  # fmt: skip
    """Fit the rig, then look for what it lacks.

    Args:
        samples: recordings.
        rig: where to start.
        free: names of its free parameters.
        effects: the library.
        most: effects that are looked for.
        doubt: relative standard deviation of the rig's parameters around the start.
        report: told what is being done.
    """
    report("fitting the rig alone")
    setting, base = base_fit(samples, rig, free, doubt)
    here, shaped, rounds = base, None, []
    for _ in range(most):
        found = search(setting, here, effects, report)
        rounds.append(found)
        best = found.best
        if best is None or best.criterion < NEEDED:
            break
        chosen = found.named[0] if found.named else None
        hopeless = chosen is None or chosen.criterion < NEEDED
        if hopeless or nameless(found):
            # A free shape stands in only where no name, nor two names together, come near.
            rival = polished(setting, best.fit)
            shaped = rival if shaped is None or rival.bic < shaped.bic else shaped
        if chosen is None or hopeless:
            break
        report(f"refining {chosen.term.id}")
        here = polished(setting, chosen.fit)
    named = base.bic - here.bic
    if shaped is not None and base.bic - shaped.bic > named + clearly(named):
        here = shaped
    return Found(setting, base, tuple(rounds), _backward(setting, here, base))


def clearly(gain: float) -> float:
    """By how much more a free shape must explain than a name that explains this much."""
    return max(NEEDED, _NAMELESS * abs(gain))


def is_named(term: Term) -> bool:
    """Whether a term stands for an effect of the library."""
    return isinstance(term.source, (Named, Slips))


def nameless(found: Round) -> bool:
    """Whether a free shape explains clearly more than any name."""
    if not found.shapes:
        return False
    shape = found.shapes[0].criterion
    name = found.named[0].criterion if found.named else 0.0
    return shape > NEEDED and shape > name + clearly(name)


def _backward(setting: Setting, fit: Fit, base: Fit) -> Fit:
    """Leave out what is no longer needed once the rest is there."""
    if len(fit.terms) < 2:
        return fit
    for place in range(len(fit.terms) - 1):
        fewer = descend_jointly(
            setting, without(setting, fit, place), limit=_TRY_ROUNDS, enough=1.0, sizes=False
        )
        if fewer.bic - fit.bic < NEEDED:
            return fewer
    return fit


def trimmed(found: Found) -> Found:
    """What was found without the last term."""
    final = found.final
    if len(final.terms) < 2:
        return replace(found, final=found.base)
    fewer = without(found.setting, final, len(final.terms) - 1)
    fewer = descend_jointly(found.setting, fewer, limit=_LAST_ROUNDS, enough=0.5, sizes=False)
    return replace(found, final=fewer)
