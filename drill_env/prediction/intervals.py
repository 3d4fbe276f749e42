"""How well windows determine numbers."""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit

from drill_env._types import FloatArray
from drill_env.prediction.fit import Fit, all_slopes, spread_of
from drill_env.prediction.likelihood import weights

_STEP = 1e-4
# Share of all information below which the other windows' is rounding: half the digits.
_ROUNDING = float(np.sqrt(np.finfo(np.float64).eps))


def covariance(here: Fit) -> FloatArray:
    """Of all numbers of a fit, by the sandwich of Godambe (1960); shape (m, m).

    Leads of a window depend on each other, so the curvature alone would be too sure. A fit follows
    its own errors: each window's are those of a fit without it (CR3; Bell and McCaffrey, Survey
    Methodology 28, 2002).
    """
    degrees = here.setting.criteria.degrees
    heavy = np.sqrt(weights(here.errors, here.size, degrees))
    columns = np.nan_to_num(all_slopes(here) / here.size[..., np.newaxis]) * heavy[..., np.newaxis]
    told = np.einsum("wkcm,wkcn->wmn", columns, columns, optimize=True)
    pulls = np.einsum("wkcm,wkc->wm", columns, heavy * here.errors / here.size)
    known = np.diag(1.0 / spread_of(here) ** 2)
    values, vectors = np.linalg.eigh(np.linalg.pinv(told.sum(axis=0) + known, hermitian=True))
    # In the coordinates of this root a window's information is a share of all.
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    others = np.eye(len(known)) - root.T @ told @ root
    # What one window alone determines, no other tells an error of.
    without = np.linalg.pinv(others, rcond=_ROUNDING, hermitian=True)
    pulls = np.einsum("wmn,wn->wm", without, pulls @ root)
    return np.asarray(root @ (pulls.T @ pulls + root.T @ known @ root) @ root.T, dtype=np.float64)


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
