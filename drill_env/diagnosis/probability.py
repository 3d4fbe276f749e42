"""How probable what was found is, and what it may be confused with."""

from __future__ import annotations

import math
from collections.abc import Container

from drill_env.diagnosis.rounds import NEEDED, Found, Round
from drill_env.prediction.criteria import Criteria

UNLISTED = 0.04
"""Probability that is kept for physics of no library that the best name only stands in for.

No difference between candidates tells of it. On the opened cases of the proof's seventh and eighth
runs 11 of 198 names whose probability among the candidates was near 1 stood in for something else;
three of those are told since.
"""

CONFUSED = 0.02
"""Less probable than this a rival is none, and needs no recording of its own."""


def probability_in(found: Round, name: str) -> float:
    """Probability of a candidate among all that were tried in a round."""
    return (1.0 - UNLISTED) * found.weights.get(name, 0.0)


def probability(found: Found, name: str) -> float:
    """Probability of an effect in the round that found it."""
    return max((probability_in(r, name) for r in found.rounds), default=0.0)


def of_gain(gain: float) -> float:
    """Probability of a finding that has no rival but "none".

    The odds are those of the evidence, half of the gain, over what chance reaches (`Criteria`).

    Args:
        gain: of the information criterion, or the square of its standard deviations.
    """
    odds = 0.5 * gain - Criteria().evidence
    return (1.0 - UNLISTED) / (1.0 + math.exp(-max(min(odds, 700.0), -700.0)))


def rivals(found: Found, leading: str, chosen: Container[str]) -> list[tuple[str, float, float]]:
    """Other candidates of the round that found what leads, the best first.

    Args:
        found: the search.
        leading: id of what leads; of the first round where it is of none.
        chosen: candidates that were found, so no rivals.

    Returns:
        Of each its id, probability and criterion lost to the best.
    """
    rounds = [*(r for r in found.rounds if leading in r.weights), *found.rounds]
    if not rounds or rounds[0].best is None or rounds[0].best.criterion < NEEDED:
        return []
    first, best = rounds[0], rounds[0].best.criterion
    order = sorted((*first.named, *first.shapes), key=lambda a: -a.criterion)
    return [
        (a.term.id, probability_in(first, a.term.id), best - a.criterion)
        for a in order
        if a.term.id not in chosen
    ]
