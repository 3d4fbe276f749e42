"""Whether unseen recordings follow the rig at all.

Discs that stand still are a prediction that needs neither a rig nor its input. Readings that are
predicted no better than so hold no movement that the model explains, whatever its noise is taken
for: then an effect that stills the rig, or frees it from its input, is the best name of nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.explained import ALIKE, CONFIDENT, squares_of
from drill_env.diagnosis.held_out import Judged
from drill_env.diagnosis.rounds import Found, is_named


def shares_of_movement(judged: Sequence[Judged]) -> list[tuple[float, float]]:
    """Of each reading the share of its movement that is predicted over 5 s, and what that errs by.

    It is the coefficient of determination against a disc that stands still, at the mean of its
    angles in each span. Of readings that have nothing to do with the rig it is below 0 in the
    mean. Its standard error is the jackknife over the spans. Runs that fail tell nothing.
    """
    if not judged:
        return []
    error = squares_of(judged)
    moved = squares_of(judged, [_moved(one) for one in judged])
    return [
        _share_and_error(error.sums[:, disc], moved.sums[:, disc])
        for disc in range(2)
        if error.counts[:, disc].any() and math.isfinite(error.sums[:, disc].sum())
    ]


def follow(judged: Sequence[Judged]) -> bool:
    """Whether a reading is clearly predicted better than by a disc that stands still."""
    shares = shares_of_movement(judged)
    return not shares or any(share > CONFIDENT * error for share, error in shares)


def contradict(judged: Sequence[Judged]) -> bool:
    """Whether all readings are clearly predicted worse than by discs that stand still.

    Of a disc at rest the mean of the span knows the noise to come, so errors may be a little more.
    """
    shares = shares_of_movement(judged)
    return bool(shares) and all(s + CONFIDENT * error < 1.0 - ALIKE for s, error in shares)


def only_if_they_follow(found: Found, before: Sequence[Judged], after: Sequence[Judged]) -> Found:
    """What was found; its names are rejected where unseen recordings do not follow the rig so.

    A rig that rests and is predicted to rest is not contradicted by it.

    Args:
        found: the search, decided.
        before: held-out recordings under the rig alone.
        after: under what was found.
    """
    terms = found.final.terms
    if not terms or not all(map(is_named, terms)):
        return replace(found, follows=not contradict(after))
    if follow(after):
        return found
    reason = "with it unseen readings are predicted no better than by discs that stand still"
    kept = replace(found, final=found.base, refuted=found.final, reason=reason)
    return replace(kept, follows=follow(before))


def _moved(judged: Judged) -> FloatArray:
    """How far each reading is from one of a disc that stands still, shape (n, 2)."""
    out = judged.measured.copy()
    ends = [*judged.spans[1:].tolist(), len(out)]
    for disc, channel in enumerate(judged.channels):
        for a, b in zip(judged.spans.tolist(), ends, strict=True):
            known = out[a:b, disc][np.isfinite(out[a:b, disc])]
            if len(known) and channel.startswith("theta"):
                out[a:b, disc] -= np.mean(known)
    return out


def _share_and_error(error: FloatArray, moved: FloatArray) -> tuple[float, float]:
    """Of sums of squares over spans."""
    share = _share(error.sum(), moved.sum())
    left = [_share(error.sum() - e, moved.sum() - m) for e, m in zip(error, moved, strict=True)]
    return share, math.sqrt((len(left) - 1) * float(np.var(left)))


def _share(error: float, moved: float) -> float:
    return 1.0 - error / moved if moved > 0.0 else 0.0
