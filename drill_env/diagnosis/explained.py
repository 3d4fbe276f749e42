"""Whether what was found explains what the rig alone predicts wrongly.

For physics of no library the nearest name is a surrogate, and beside other candidates it looks
certain. That unseen recordings are still predicted badly shows that it is not what is missing, or
not all of it. A model that is right errs by what its noise gives (the predictive check
of Box, Journal of the Royal Statistical Society A 143, 1980).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.held_out import Judged
from drill_env.diagnosis.lost_counts import LostCounts
from drill_env.diagnosis.noise_floor import sensor_noise
from drill_env.diagnosis.rounds import Found, is_named
from drill_env.diagnosis.strikes import Once
from drill_env.diagnosis.terms import Named
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.noise import ALIKE

CONFIDENT = 1.96
"""Standard errors of a share that hold 95 % of a normal."""

# Of a motion that noise drives, two courses differ by twice its mean square and no prediction need
# err by more than once: by so much at most a right model errs more than another one.
_DRIVEN = 2.0


def explained_share(before: float, after: float, floor: float = 0.0) -> float:
    """Share of a mean squared error beyond that of noise which is gone.

    Args:
        before: mean square under the rig alone.
        after: with what was found.
        floor: what noise gives.

    Returns:
        1 where the rig alone errs little more than noise lets it, so that nothing is told unless
        what was found errs far more.
    """
    if not math.isfinite(after):
        return 1.0
    if not before > ALIKE * floor:
        usual = max(before, min(floor, _DRIVEN * before))
        return 1.0 - after / usual if after > ALIKE * usual else 1.0
    return 1.0 - max(after - floor, 0.0) / (before - floor)


def happened_once(source: object) -> bool:
    """Whether a term is of single moments, which no other recording foresees."""
    return isinstance(source, (LostCounts, Once))


def may_leave_more(sources: Sequence[object]) -> bool:
    """Whether what is found may stand though much else is missing.

    What most machines have stands beside anything. What happened once is foreseen by nothing, but
    is no excuse for the names beside it.
    """
    asked = [source for source in sources if not happened_once(source)]
    return not asked or any(isinstance(s, Named) and s.effect.common for s in asked)


def that_explain(
    found: Found, before: Sequence[Judged], after: Sequence[Judged],
    drawn: Mapping[str, Sequence[FloatArray]], criteria: Criteria,
) -> Found:  # fmt: skip
    """What was found, its names rejected where they explain too little of unseen recordings.

    A name must take away the share of the error beyond noise that it must explain of a free
    function, within the share's standard error, and some of it at all. What the fit takes for noise
    is none where it would give twice the squared error that is there: then the sensors' noise alone
    is. A name that most machines have stands beside whatever else is missing, and of what
    happened once alone nothing is asked.

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
    if may_leave_more(sources):
        return found
    sensor = sum(s**2 for s in sensor_noise(found.final.noise, after[0].channels))
    kinds = (squares_of(before), squares_of(after), squares_of(after, drawn["short"]))
    share, error = _share(*kinds, sensor)
    found = replace(found, explained=share)
    # Within its standard error a share is no less than what it must be.
    if share > 0.0 and share + CONFIDENT * error >= criteria.share:
        return found
    reason = (
        f"it removes only {share:.0%} of the squared error of unseen 5 s predictions"
        if share > 0.0
        else "with it unseen 5 s predictions err no less than without it"
    )
    return replace(found, final=found.base, refuted=found.final, reason=reason)


@dataclass(frozen=True, slots=True, eq=False)
class Squares:
    """Sums of squared errors over spans of predictions, and what was counted; shape (spans, 2)."""

    sums: FloatArray
    counts: FloatArray

    def mean(self, leave_out: int | None = None) -> float:
        """Mean square of both readings together, one span left out."""
        total, count = (
            part.sum(axis=0) - (0.0 if leave_out is None else part[leave_out])
            for part in (self.sums, self.counts)
        )
        return float(np.sum(total[count > 0.0] / count[count > 0.0]))


def squares_of(judged: Sequence[Judged], errors: Sequence[FloatArray] | None = None) -> Squares:
    """Of predictions against what was measured, or of given errors over the same spans."""
    errors = errors or [j.short - j.measured for j in judged]
    known = [~np.isnan(e) for e in errors]
    with np.errstate(over="ignore"):
        squares = [np.where(k, e, 0.0) ** 2 for k, e in zip(known, errors, strict=True)]
    sums, counts = (
        np.concatenate(
            [np.add.reduceat(p.astype(float), j.spans) for p, j in zip(part, judged, strict=True)]
        )
        for part in (squares, known)
    )
    return Squares(sums, counts)


def _share(before: Squares, after: Squares, drawn: Squares, sensor: float) -> tuple[float, float]:
    """Share of the error that is gone, and its standard error: the jackknife over the spans."""
    noise = drawn.mean() + sensor
    if noise > ALIKE * after.mean():
        drawn, noise = Squares(np.zeros_like(drawn.sums), drawn.counts), sensor
    share = explained_share(before.mean(), after.mean(), noise)
    n = len(before.sums)
    if n < 2 or share == 1.0:
        return share, 0.0
    left = [
        explained_share(before.mean(i), after.mean(i), drawn.mean(i) + sensor) for i in range(n)
    ]
    return share, math.sqrt((n - 1) * float(np.var(left)))
