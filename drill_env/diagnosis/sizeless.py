"""Where to begin with effects that no number makes vanish in proportion.

The slopes of the likelihood at the rig without them tell little of a play, a delay or a resonance:
what they change is no multiple of anything. The likelihood itself has several peaks over their
numbers, and the highest one may show only after the rig has followed: descents begin at several.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.at_rest import alone
from drill_env.diagnosis.attempts import attempted, behind, worth_a_round
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.grids import grid_of
from drill_env.diagnosis.ground import Ground
from drill_env.diagnosis.joint import descend_jointly
from drill_env.diagnosis.moves import added, gain_of, own_values
from drill_env.diagnosis.rounds import Attempt
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import Effect

# Peaks at which descents begin, and rounds of the one that goes on.
_PEAKS, _ROUNDS = 3, 12
# Points closer than this factor in every number are on one peak.
_CLOSE = 1.3


def has_peaks(effect: Effect) -> bool:
    """Whether the likelihood has several peaks over the numbers of an effect without a size."""
    return len(effect.parameters) > 1 and all(p.role != "amplitude" for p in effect.parameters)


def descended(ground: Ground, effect: Effect, done: Sequence[Attempt]) -> Attempt:
    """The best attempt with such an effect from the highest peaks.

    The rig follows for one round at each peak; where that leads highest the descent goes on, for as
    long as it may still become the best attempt.

    Args:
        ground: where it joins.
        effect: it.
        done: attempts with others.
    """
    setting, fit, source = ground.setting, ground.fit, Named(effect)
    points = [source.bounded(q) for q in grid_of(effect, ground)]
    # The recording that is explained worst tells the peaks.
    worst = max(range(len(ground.known)), key=lambda i: float(np.mean(ground.known[i].white ** 2)))
    gains = _gains(*alone(setting, fit, worst), source, points)
    starts = [added(setting, fit, Term(source, q)) for q in _peaks(points, gains)]
    starts = [descend_jointly(setting, s, limit=1, enough=1.0, only=None) for s in starts]
    best = attempted(fit, min(starts, key=lambda there: there.value))
    enough = worth_a_round(behind(best, done), _ROUNDS)
    there = descend_jointly(setting, best.fit, limit=_ROUNDS, enough=enough, only=None)
    return attempted(fit, there)


def _gains(setting: Setting, fit: Fit, source: Named, points: Sequence[FloatArray]) -> list[float]:
    own = own_values(setting, fit)
    return [gain_of(setting, fit, Term(source, q), own) for q in points]


def _peaks(points: Sequence[FloatArray], gains: Sequence[float]) -> list[FloatArray]:
    """The best points that are apart from each other."""
    found: list[FloatArray] = []
    for i in sorted(range(len(points)), key=lambda i: -gains[i]):
        q = np.maximum(points[i], 1e-12)
        if all(np.abs(np.log(q / np.maximum(f, 1e-12))).max() > np.log(_CLOSE) for f in found):
            found.append(points[i])
        if len(found) == _PEAKS:
            break
    return found
