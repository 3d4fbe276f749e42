"""Whether what was found explains what the rig alone predicts wrongly.

For physics of no library the nearest name is a surrogate, and beside other candidates it looks
certain. That unseen recordings are still predicted badly shows that it is not what is missing, or
not all of it. A model that is right errs by what its noise gives (the predictive check
of Box, Journal of the Royal Statistical Society A 143, 1980).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from drill_env._types import FloatArray
from drill_env.diagnosis.held_out import Judged
from drill_env.diagnosis.lost_counts import LostCounts
from drill_env.diagnosis.noise_floor import mean_square, sensor_noise
from drill_env.diagnosis.rounds import Found, is_named
from drill_env.diagnosis.strikes import Once
from drill_env.diagnosis.terms import Named
from drill_env.prediction.criteria import Criteria

# Mean squares of a draw and of an error that differ by less than this factor may be alike.
_ALIKE = 2.0


def explained_share(before: float, after: float, floor: float = 0.0) -> float:
    """Share of a mean squared error beyond that of noise which is gone.

    Args:
        before: mean square under the rig alone.
        after: with what was found.
        floor: what noise gives.

    Returns:
        1 where the rig alone errs little more than noise lets it, so that nothing is told.
    """
    if not before > _ALIKE * floor or not math.isfinite(after):
        return 1.0
    return 1.0 - max(after - floor, 0.0) / (before - floor)


def may_leave_more(source: object) -> bool:
    """Whether what is found may stand though much else is missing.

    What most machines have stands beside anything, and what happened once is foreseen by nothing.
    """
    once = isinstance(source, (LostCounts, Once))
    return once or (isinstance(source, Named) and source.effect.common)


def that_explain(
    found: Found, before: Sequence[Judged], after: Sequence[Judged],
    drawn: Mapping[str, Sequence[FloatArray]], criteria: Criteria,
) -> Found:  # fmt: skip
    """What was found, its names rejected where they explain too little of unseen recordings.

    A name must take away the share of the error beyond noise that it must explain of a free
    function. What the fit takes for noise is none where it would give twice the squared error that
    is there: then the sensors' noise alone is. A name that most machines have stands beside
    whatever else is missing, and what happened once is foreseen by nothing.

    Args:
        found: the search, decided.
        before: held-out recordings under the rig alone.
        after: with what was found.
        drawn: of `errors_by_noise`, with what was found.
        criteria: of the decision.
    """
    sources = [t.source for t in found.final.terms]
    if not before or not sources or not all(is_named(t) for t in found.final.terms):
        return found
    if any(may_leave_more(s) for s in sources):
        return found
    first, last = (mean_square(j.short - j.measured for j in judged) for judged in (before, after))
    sensor = sum(s**2 for s in sensor_noise(found.final.noise, after[0].channels))
    noise = mean_square(drawn["short"]) + sensor
    share = explained_share(first, last, noise if noise <= _ALIKE * last else sensor)
    found = replace(found, explained=share)
    if share >= criteria.share:
        return found
    reason = f"it removes only {share:.0%} of the squared error of unseen 5 s predictions"
    return replace(found, final=found.base, refuted=found.final, reason=reason)
