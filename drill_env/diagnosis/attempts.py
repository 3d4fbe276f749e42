"""Candidates fitted together with the rig and the noise, the hopeful ones for longer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from drill_env.diagnosis.extended import evaluate
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.joint import SIZES, TORQUES, descend_jointly
from drill_env.diagnosis.moves import added, with_new_motions
from drill_env.diagnosis.resonance import resonates, retuned
from drill_env.diagnosis.rounds import NEEDED, Attempt, Round, is_named
from drill_env.identification.noise import NoiseModel

FIRST_ROUNDS = 2
"""Rounds of a candidate's first descent."""

# Rounds more for candidates whose gain is not below this share of the best one's, and how many.
# The last ones get motions that are told anew with the candidate in place.
_HEATS = ((4, 0.3, 6, False), (6, 0.4, 3, True), (6, 0.5, 3, True))
# A hopeless candidate that gained less than this rests.
_MOVES = 1.0
# Resonances are retuned if they gain this share of the best one.
_HOPEFUL_RESONANCE = 0.5
# Logarithm of a correlation time over the usual one from which on candidates get their own.
_UNUSUAL = 0.3
# How many names are begun again with the usual noise then, how often and for how many rounds.
_TIGHT, _TIGHTENINGS, _TIGHT_ROUNDS = 2, 2, 10


def carried_on(
    setting: Setting, fit: Fit, start: Fit, rounds: int, *, anew: bool = False
) -> Attempt:
    """A candidate descended for so many rounds.

    Args:
        setting: recordings and free parameters.
        fit: without the candidate.
        start: with it.
        rounds: most rounds.
        anew: whether motions are told anew with the candidate in place.
    """
    begin = with_new_motions(setting, start) if anew else start
    only = TORQUES if rounds > FIRST_ROUNDS and unusual(fit.noise) else SIZES
    done = descend_jointly(setting, begin, limit=rounds, enough=2.0, only=only)
    return attempted(fit, start if done.value > start.value else done)


def unusual(noise: NoiseModel) -> bool:
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


def attempted(before: Fit, fit: Fit) -> Attempt:
    """A fit with a candidate as its last term, against the fit without."""
    return Attempt(fit, fit.terms[-1], before.value - fit.value, before.bic - fit.bic)


def heated(setting: Setting, fit: Fit, done: list[Attempt]) -> list[Attempt]:
    """More rounds for the more hopeful ones, the best first."""
    resting: set[str] = set()
    for rounds, hope, most, anew in _HEATS:
        done.sort(key=lambda a: -a.gain)
        least = max(hope * done[0].gain, 5.0) if done else 0.0
        for i, a in enumerate(done[:most]):
            if a.gain > least and a.term.id not in resting:
                done[i] = after = carried_on(setting, fit, a.fit, rounds, anew=anew)
                if after.criterion < NEEDED and after.gain < a.gain + _MOVES:
                    resting.add(a.term.id)
    return sorted(done, key=lambda a: -a.gain)


def with_resonances_retuned(setting: Setting, fit: Fit, done: list[Attempt]) -> list[Attempt]:
    """Hopeful resonances at their best frequency, the best attempts first."""
    least = max(_HOPEFUL_RESONANCE * max((a.gain for a in done), default=0.0), NEEDED)
    done = [
        attempted(fit, retuned(setting, a.fit)) if resonates(a.term) and a.gain > least else a
        for a in done
    ]
    return sorted(done, key=lambda a: -a.gain)


def tightened(setting: Setting, fit: Fit, done: Sequence[Attempt]) -> list[Attempt]:
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
            again.append(attempted(fit, there))
    return again


def best_of_each(done: Sequence[Attempt]) -> list[Attempt]:
    """Attempts by criterion, the best of each candidate only."""
    best: dict[str, Attempt] = {}
    for attempt in sorted(done, key=lambda a: -a.criterion):
        best.setdefault(attempt.term.id, attempt)
    return list(best.values())


def restated(first: Round, fit: Fit) -> Round:
    """A round in which the last term of a fit does as well as it does there."""
    term = fit.terms[-1]
    named = [attempted(first.before, fit), *(a for a in first.named if a.term.id != term.id)]
    return replace(first, named=tuple(best_of_each(named)))
