"""How well windows determine numbers."""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit

from drill_env._types import FloatArray
from drill_env.prediction.fit import Fit, all_slopes, spread_of
from drill_env.prediction.likelihood import weights

_STEP = 1e-4


def covariance(here: Fit) -> FloatArray:
    """Of all numbers of a fit, by the sandwich of Godambe (1960); shape (m, m).

    Leads of a window depend on each other, so the curvature alone would be too sure. A fit follows
    its own errors: each window's are those of a fit without it (CR3; Bell and McCaffrey, Survey
    Methodology 28, 2002).
    """
    windows, degrees = len(here.errors), here.setting.criteria.degrees
    root = np.sqrt(weights(here.errors, here.size, degrees))
    columns = np.nan_to_num(all_slopes(here) / here.size[..., np.newaxis])
    columns = (columns * root[..., np.newaxis]).reshape(windows, root[0].size, -1)
    errors = (root * here.errors / here.size).reshape(windows, -1)
    known = np.diag(1.0 / spread_of(here) ** 2)
    curvature = np.einsum("wkm,wkn->mn", columns, columns, optimize=True)
    bread = np.linalg.pinv(curvature + known, hermitian=True)
    rest = np.eye(errors.shape[1]) - columns @ bread @ columns.swapaxes(1, 2)
    # What one window alone determines has no error of its own, and no other tells one.
    left = (np.linalg.pinv(rest, hermitian=True) @ errors[..., np.newaxis])[..., 0]
    pulls = np.einsum("wkm,wk->wm", columns, left)
    return np.asarray(bread @ (pulls.T @ pulls + known) @ bread, dtype=np.float64)


def quantile(here: Fit) -> float:
    """Of Student's t on either side of 95 %, a degree of freedom less than windows.

    As MacKinnon, Nielsen and Webb, J. of Econometrics 232 (2023), take it with that sandwich.
    """
    return float(stdtrit(max(len(here.errors) - 1, 1), 0.975))


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
