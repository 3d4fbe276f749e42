"""Search for what is missing: score every candidate, try the best, keep what the data demand."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from drill_env._errors import InputError
from drill_env.diagnosis.clock import cleaned, with_uncertain_times
from drill_env.diagnosis.contest import contest
from drill_env.diagnosis.extended import evaluate, motion_of
from drill_env.diagnosis.faults import clock_jitter
from drill_env.diagnosis.first_look import first_look
from drill_env.diagnosis.fit import Fit, Setting, strain
from drill_env.diagnosis.ground import ground_at
from drill_env.diagnosis.joint import SIZES, TORQUES, descend_jointly, polished
from drill_env.diagnosis.moves import added, unstrained, with_new_motions
from drill_env.diagnosis.resonance import resonates, retuned
from drill_env.diagnosis.rounds import (
    NEEDED,
    NEEDED_BESIDE,
    Attempt,
    Found,
    Round,
    at_its_limit,
    clearly,
    in_its_place,
    is_named,
    nameless,
    rigs_own,
)
from drill_env.diagnosis.scan import Scored, score_effects, score_shapes
from drill_env.diagnosis.shapes import come_round, free_shapes
from drill_env.diagnosis.slips import broken_counts, slips
from drill_env.diagnosis.terms import Shape
from drill_env.diagnosis.waves import Wave, free_waves, score_waves
from drill_env.diagnosis.within import within_filter
from drill_env.effects import Effect
from drill_env.identification.coordinates import Coordinates
from drill_env.identification.noise import NoiseModel
from drill_env.identification.prediction_error import path_of
from drill_env.identification.samples import Samples
from drill_env.parameters import Rig

_RELEASE = 6.0
# Effects and shapes that get a first look; a rig without what it lacks most scores badly.
_WIDTHS, _LATER_WIDTHS = (12, 5), (7, 3)
_TRIED, _TRIED_SHAPES, _TRIED_WAVES = 6, 2, 2
_BASE_ROUNDS = 25
_FIRST_ROUNDS, _HOME_ROUNDS = 2, 5
# Squared standard deviations a parameter above which a fitted rig counts as bent.
_STRAINED = 3.0
# Rounds more for candidates whose gain is not below this share of the best one's, and how many.
# The last ones get motions that are told anew with the candidate in place.
_HEATS = ((4, 0.3, 6, False), (6, 0.4, 3, True), (6, 0.5, 3, True))
# Resonances are retuned if they gain this share of the best one.
_RETUNED = 0.5
# Logarithm of a correlation time over the usual one from which on candidates get their own.
_UNUSUAL = 0.3
# How many names are begun again with the usual noise then, how often and for how many rounds.
_TIGHT, _TIGHTENINGS, _TIGHT_ROUNDS = 2, 2, 10
# Scores fall short of the gain that a fit with its noise reaches.
_SLACK = 15.0

Report = Callable[[str], None]


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
    if not math.isfinite(here.value):
        raise InputError(
            "the given rig has no likelihood on these recordings: look for readings that are "
            "infinite, and for a rig file with numbers far from the rig's"
        )
    here = descend_jointly(plain, here, limit=_BASE_ROUNDS, enough=1.0, only=None)
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
    waves = score_waves(ground, _waves_of(fit, effects))
    wanted = {effect.id for effect in effects}
    found = [pair for pair in (slips(ground, 0), slips(ground, 1)) if pair is not None]
    lost = [(term, gain) for term, gain in found if term.id in wanted]
    wide, wide_shapes = _LATER_WIDTHS if fit.terms else _WIDTHS
    likely = (*named[:wide], *shapes[:wide_shapes], *waves)
    hopeful = [s for s in likely if s.gain - s.numbers * price > -_SLACK]
    hopeful += [Scored(term, gain) for term, gain in lost if gain - len(term.q) * price > 0.0]
    done: list[Attempt] = []
    for start in _starts(setting, fit, hopeful):
        report(f"trying {start.terms[-1].id}")
        done.append(_attempt(setting, fit, start, _FIRST_ROUNDS))
    done = _retuned(setting, fit, _heated(setting, fit, done))
    if _unusual(fit.noise):
        report("trying with the usual noise")
        done = sorted([*done, *_tightened(setting, fit, done)], key=lambda a: -a.gain)
    if not fit.terms and done and strain(setting, done[0].fit) > _STRAINED * len(fit.vector):
        report("trying from the given rig")
        starts = _from_home(setting, fit, effects)
        done += _heated(setting, fit, [_attempt(setting, fit, s, _HOME_ROUNDS) for s in starts])
    done = [a for a in _best_of_each(done) if not broken_counts(a.term, setting.samples)]
    return Round(
        fit, (*named, *shapes, *waves),
        tuple(a for a in done if is_named(a.term) and not at_its_limit(a, done)),
        tuple(a for a in done if not is_named(a.term) and not rigs_own(a)),
    )  # fmt: skip


def _starts(setting: Setting, fit: Fit, hopeful: Sequence[Scored]) -> list[Fit]:
    """Where the candidates of most promise start: names, functions of a coordinate and waves."""
    looked = sorted((first_look(setting, fit, s) for s in hopeful), key=lambda pair: -pair[0])
    starts = [start for _, start in looked]
    names = [start for start in starts if is_named(start.terms[-1])]
    free = [start for start in starts if not is_named(start.terms[-1])]
    waves = [start for start in free if isinstance(start.terms[-1].source, Wave)]
    shapes = [start for start in free if isinstance(start.terms[-1].source, Shape)]
    return [*names[:_TRIED], *shapes[:_TRIED_SHAPES], *waves[:_TRIED_WAVES]]


def _waves_of(fit: Fit, effects: Sequence[Effect]) -> list[Wave]:
    inertias = fit.rig.inertias
    known = {effect.id for effect in effects}
    return free_waves(known, inertias, turning=come_round(fit.motions, inertias))


def _from_home(setting: Setting, fit: Fit, effects: Sequence[Effect]) -> list[Fit]:
    """Candidates tried at the given rig: a rig that was bent to do without one hides it."""
    home = unstrained(setting, fit)
    named = score_effects(ground_at(setting, home), effects)[:_TRIED]
    return [first_look(setting, home, s)[1] for s in named]


def _heated(setting: Setting, fit: Fit, done: list[Attempt]) -> list[Attempt]:
    """More rounds for the more hopeful ones, the best first."""
    for rounds, hope, most, anew in _HEATS:
        done.sort(key=lambda a: -a.gain)
        least = max(hope * done[0].gain, 5.0) if done else 0.0
        done = [
            _attempt(setting, fit, a.fit, rounds, anew=anew) if i < most and a.gain > least else a
            for i, a in enumerate(done)
        ]
    return sorted(done, key=lambda a: -a.gain)


def _retuned(setting: Setting, fit: Fit, done: list[Attempt]) -> list[Attempt]:
    """Hopeful resonances at their best frequency, the best attempts first."""
    least = max(_RETUNED * max((a.gain for a in done), default=0.0), NEEDED)
    done = [
        _attempted(fit, retuned(setting, a.fit)) if resonates(a.term) and a.gain > least else a
        for a in done
    ]
    return sorted(done, key=lambda a: -a.gain)


def _tightened(setting: Setting, fit: Fit, done: Sequence[Attempt]) -> list[Attempt]:
    """The most hopeful names begun again with the usual noise.

    A torque that is slow and large follows what is missing, and holds no number in its place: a
    descent ends anywhere. Under little noise all numbers are told, from far away too.
    """
    again = []
    noise = replace(fit.noise, **_usual_where_unusual(fit.noise))
    for attempt in [a for a in done if is_named(a.term)][:_TIGHT]:
        there = attempt.fit
        for _ in range(_TIGHTENINGS):
            here = added(setting, fit, there.terms[-1])
            start = evaluate(setting, here.vector, here.terms, noise, here.starts, here.motions)
            there = descend_jointly(setting, start, limit=_TIGHT_ROUNDS, enough=2.0, only=None)
            again.append(_attempted(fit, there))
    return again


def _best_of_each(done: Sequence[Attempt]) -> list[Attempt]:
    """Attempts by criterion, the best of each candidate only."""
    best: dict[str, Attempt] = {}
    for attempt in sorted(done, key=lambda a: -a.criterion):
        best.setdefault(attempt.term.id, attempt)
    return list(best.values())


def _attempt(setting: Setting, fit: Fit, start: Fit, rounds: int, *, anew: bool = False) -> Attempt:
    begin = with_new_motions(setting, start) if anew else start
    only = TORQUES if rounds > _FIRST_ROUNDS and _unusual(fit.noise) else SIZES
    done = descend_jointly(setting, begin, limit=rounds, enough=2.0, only=only)
    return _attempted(fit, start if done.value > start.value else done)


def _unusual(noise: NoiseModel) -> bool:
    """Whether a torque is so slow or fast that it may be what is missing, not noise."""
    return bool(_usual_where_unusual(noise))


def _usual_where_unusual(noise: NoiseModel) -> dict[str, float]:
    """Usual sizes and correlation times of the torques that are slow or fast."""
    usual, found = NoiseModel(), {}
    for disc in ("u", "l"):
        size, time = f"torque_{disc}", f"tau_{disc}"
        if abs(math.log(getattr(noise, time) / getattr(usual, time))) > _UNUSUAL:
            found |= {name: getattr(usual, name) for name in (size, time)}
    return found


def _attempted(before: Fit, fit: Fit) -> Attempt:
    return Attempt(fit, fit.terms[-1], before.value - fit.value, before.bic - fit.bic)


def _base(
    samples: Sequence[Samples], rig: Rig, free: Sequence[str], doubt: float, report: Report
) -> tuple[Setting, Fit]:
    """The rig alone, without stale rows and with the times as uncertain as they are."""
    report("fitting the rig alone")
    samples = cleaned(samples)
    setting, base = base_fit(samples, rig, free, doubt)
    clock = clock_jitter(setting, base)
    if clock is None:
        return setting, base
    report("fitting the rig alone, the times uncertain")
    size = clock.parameters["jitter"][0]
    setting, base = base_fit([with_uncertain_times(s, size) for s in samples], rig, free, doubt)
    return replace(setting, jitter=size), base


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
    setting, base = _base(samples, rig, free, doubt, report)
    here, shaped, refuted, rounds = _sought(setting, base, effects, most, report)
    named = base.bic - here.bic
    if shaped is not None and refuted is None and base.bic - shaped.bic <= named + clearly(named):
        shaped = None
    report("asking again what was found first")
    terms = len(here.terms)
    here, contests = contest(setting, here, rounds)
    if terms > len(here.terms) == 1:
        rounds = [_restated(rounds[0], here)]
    here = within_filter(setting, here, report)
    return Found(setting, base, tuple(rounds), here, contests, shaped, refuted)


def _restated(first: Round, fit: Fit) -> Round:
    """The first round when a term that was found later does better without what was found first."""
    term = fit.terms[-1]
    named = _best_of_each(
        [_attempted(first.before, fit), *(a for a in first.named if a.term.id != term.id)]
    )
    return replace(first, named=tuple(named))


def _sought(
    setting: Setting, base: Fit, effects: Sequence[Effect], most: int, report: Report
) -> tuple[Fit, Fit | None, Fit | None, list[Round]]:
    """Look for one effect after another.

    Returns:
        The fit with all names; with a free shape in their place, if one explains more; with a name
        that is given up for one, if any; and the rounds of the search.
    """
    here, shaped, rounds = base, None, []
    # A step of an encoder that was overlooked is no other effect and takes no effect's place.
    while len({term.id for term in here.terms}) < most and len(rounds) <= most:
        found = search(setting, here, effects, report)
        rounds.append(found)
        best, needed = found.best, NEEDED_BESIDE if here.terms else NEEDED
        if best is None or best.criterion < needed:
            break
        instead = in_its_place(rounds[-2], found) if here.terms else None
        if instead is not None:
            report(f"refining {instead.term.id} in place of {here.terms[-1].id}")
            return here, polished(setting, instead.fit), here, rounds
        chosen = found.named[0] if found.named else None
        hopeless = chosen is None or chosen.criterion < needed
        if hopeless or nameless(found):
            # A free shape stands in only where no name, nor two names together, come near.
            rival = polished(setting, best.fit)
            # One that came without the name that was chosen gives way to no small gain.
            shaped = rival if shaped is None or rival.bic < shaped.bic - NEEDED else shaped
        if chosen is None or hopeless:
            break
        report(f"refining {chosen.term.id}")
        here = polished(setting, chosen.fit)
    return here, shaped, None, rounds
