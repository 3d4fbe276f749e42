"""How well windows determine numbers."""

from __future__ import annotations

import numpy as np

from drill_env._types import FloatArray
from drill_env.prediction.fit import Fit, all_slopes, spread_of
from drill_env.prediction.likelihood import weights

_STEP = 1e-4


def covariance(here: Fit) -> FloatArray:
    """Of all numbers of a fit, by the sandwich of Godambe (1960); shape (m, m).

    Leads of a window depend on each other, so the curvature alone would be too sure.
    """
    degrees = here.setting.criteria.degrees
    columns = np.nan_to_num(all_slopes(here) / here.size[..., np.newaxis])
    weight = weights(here.errors, here.size, degrees)
    pulls = np.einsum("wkcm,wkc->wm", columns, weight * here.errors / here.size)
    curvature = np.einsum("wkcm,wkc,wkcn->mn", columns, weight, columns, optimize=True)
    known = np.diag(1.0 / spread_of(here) ** 2)
    bread = np.linalg.pinv(curvature + known, hermitian=True)
    return np.asarray(bread @ (pulls.T @ pulls + known) @ bread, dtype=np.float64)


def deviations(here: Fit, place: int, spread: FloatArray) -> dict[str, tuple[float, float]]:
    """Value and standard deviation of each number of one candidate, by name.

    Args:
        here: a fit.
        place: which candidate.
        spread: covariance of all its numbers.
    """
    candidate, z = here.candidates[place], here.numbers[place]
    first = len(here.vector) + sum(c.size for c in here.candidates[:place])
    own = spread[first : first + candidate.size, first : first + candidate.size]
    values = _values(candidate.entry(z))
    rows = []
    for i in range(candidate.size):
        moved = z.copy()
        moved[i] += _STEP
        there = _values(candidate.entry(moved))
        rows.append([(there[name] - values[name]) / _STEP for name in values])
    slopes = np.array(rows)
    sizes = np.sqrt(np.maximum(np.einsum("in,ij,jn->n", slopes, own, slopes), 0.0))
    return {n: (v, float(s)) for (n, v), s in zip(values.items(), sizes, strict=True)}


def _values(entry: dict) -> dict[str, float]:
    return {key: value for key, value in entry.items() if isinstance(value, float)}
