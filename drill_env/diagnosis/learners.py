"""How much of a residual the motion predicts, by whatever formula and by a linear memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, stdtrit
from threadpoolctl import threadpool_limits

from drill_env._types import BoolArray, FloatArray, IntArray
from drill_env.diagnosis.motion_features import features_of, memory_of
from drill_env.effects.along import Motion

# Rows that are learnt from; smoothed torques change little from one row to the next.
_ROWS = 6000
_FEWEST = 300
# Parts of a lone recording: the fewest of which one can be predicted from another.
_PARTS = 2
# Of a byte, less the one for values that are missing.
_BINS = 255
# Strengths of the ridge, in shares of the columns' squares: from as much as the columns themselves
# to what rounding asks for.
_RIDGES = tuple(10.0**-power for power in range(7))


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """What is learnt from in one recording.

    Attributes:
        features: for trees, shape (n, a).
        memories: for linear laws with a memory, of the voltage and of its size too, shape (n, b).
    """

    features: FloatArray
    memories: tuple[FloatArray, ...]

    def at(self, rows: IntArray | slice) -> Known:
        """Some rows of it."""
        return Known(self.features[rows], tuple(one[rows] for one in self.memories))


def known_of(names: Sequence[str], motion: Motion) -> Known:
    """What is learnt from of some coordinates.

    Args:
        names: of the coordinates.
        motion: how the rig moved.
    """
    features = np.hstack([features_of(name, motion) for name in names])
    sizes = (False, True) if "voltage" in names else ()
    return Known(features, tuple(memory_of(motion, sizes=size) for size in sizes))


def share_of(known: Sequence[Known], values: Sequence[FloatArray]) -> float:
    """Share of the squares of values that is predicted in recordings that were not learnt from.

    Each is predicted from the others, by boosted trees and by ridge regression on memories. Of
    noise every learner predicts less than nothing, so the best of them hardly more. All recordings
    count alike: of one that has most of the squares, as numbers fitted to others are wrong for it,
    what is predicted tells of these numbers.

    Args:
        known: of each recording.
        values: of shape (n,) each.
    """
    step = max(1, sum(map(len, values)) // _ROWS)
    known = [one.at(slice(None, None, step)) for one in known]
    y = np.concatenate([v[::step] for v in values])
    if len(y) < _FEWEST or not np.any(y):
        return 0.0
    group = _groups([len(v[::step]) for v in values])
    weight = _weights(y, group)
    # Leaves need values of order one to tell a gain from rounding.
    level = float(np.mean(weight))
    y, weight = y * np.sqrt(level), weight / level
    shares = [_by_trees(np.concatenate([one.features for one in known]), y, weight, group)]
    memories = [np.concatenate(each) for each in zip(*(k.memories for k in known), strict=True)]
    return max(shares + ([_by_ridge(memories, y, weight, group)] if memories else []))


def _weights(y: FloatArray, group: IntArray) -> FloatArray:
    """One over the mean square of what is predicted together, shape (n,)."""
    squares = np.bincount(group, y**2) / np.bincount(group)
    # Of a recording in which nothing is left, nothing is to be predicted.
    squares[squares == 0.0] = np.inf
    return np.asarray(1.0 / squares[group], dtype=np.float64)


def _by_trees(x: FloatArray, y: FloatArray, weight: FloatArray, group: IntArray) -> float:
    # A second for its import is spent by those who diagnose only.
    from sklearn.ensemble import HistGradientBoostingRegressor

    x, missed = _binned(x), 0.0
    for number in np.unique(group).tolist():
        unseen = group == number
        trees = HistGradientBoostingRegressor(
            max_iter=40, learning_rate=0.2, max_leaf_nodes=15, l2_regularization=1.0,
            min_samples_leaf=40, early_stopping=False, random_state=0,
        )  # fmt: skip
        # They came after the limit that the diagnosis sets, and few rows are slower with more.
        with threadpool_limits(1):
            trees.fit(x[~unseen], y[~unseen], sample_weight=weight[~unseen])
            missed += float(weight[unseen] @ (y[unseen] - trees.predict(x[unseen])) ** 2)
    return 1.0 - missed / float(weight @ y**2)


def _binned(x: FloatArray) -> FloatArray:
    """Which of its column's quantiles each value is beyond, as many as trees tell apart.

    They would look for these themselves, anew each time and, of weighted rows, for seconds.
    """
    edges = np.quantile(x, np.linspace(0.0, 1.0, _BINS)[1:-1], axis=0)
    columns = [np.searchsorted(e, v) for e, v in zip(edges.T, x.T, strict=True)]
    return np.column_stack(columns).astype(np.float64)


def _by_ridge(
    memories: Sequence[FloatArray], y: FloatArray, weight: FloatArray, group: IntArray
) -> float:
    """The share of ridge regression (Hoerl and Kennard, Technometrics 12, 1970).

    How strong it is, and on which memory, no evidence tells here, as neighbouring rows are alike:
    recordings that were not learnt from do. Of slow noise they are few, and one model or another
    predicts some by chance: the simplest within one standard error of the best counts (Breiman,
    Friedman, Olshen and Stone, Classification and Regression Trees, 1984), that of the difference,
    as some recordings have more noise than others, and as wide as so few of them make it (Student,
    Biometrika 6, 1908).

    Args:
        memories: of shape (n, b) each, the simplest first.
        y: values, shape (n,).
        weight: of their squares, shape (n,).
        group: what is predicted together, shape (n,).
    """
    parts = [group == number for number in np.unique(group)]
    missed = np.concatenate([_missed(x, y, weight, parts) for x in memories])
    total = missed.sum(axis=1)
    best = int(np.argmin(total))
    more = missed - missed[best]
    wide = float(stdtrit(len(parts) - 1, ndtr(1.0)))
    error = wide * np.sqrt(len(parts) * np.var(more, axis=1, ddof=1))
    simplest = int(np.flatnonzero(more.sum(axis=1) <= error)[0])
    return 1.0 - float(total[simplest]) / float(weight @ y**2)


def _missed(
    x: FloatArray, y: FloatArray, weight: FloatArray, parts: Sequence[BoolArray]
) -> FloatArray:
    """Squares that are left of each part under each ridge, the strongest first."""
    size = x.std(axis=0)
    x = (x - x.mean(axis=0)) / np.where(size > 0.0, size, 1.0)
    root = np.sqrt(weight)
    x, y = np.column_stack([x, np.ones(len(x))]) * root[:, None], y * root
    squares = np.array([x[part].T @ x[part] for part in parts])
    products = np.array([x[part].T @ y[part] for part in parts])
    missed = np.zeros((len(_RIDGES), len(parts)))
    for i, (part, square, product) in enumerate(zip(parts, squares, products, strict=True)):
        seen, told = squares.sum(axis=0) - square, products.sum(axis=0) - product
        for place, ridge in enumerate(_RIDGES):
            strength = ridge * (len(y) - int(part.sum())) * np.eye(len(seen))
            law = np.linalg.solve(seen + strength, told)
            left = law @ square @ law - 2.0 * law @ product + y[part] @ y[part]
            missed[place, i] = left
    return missed


def _groups(lengths: Sequence[int]) -> IntArray:
    """A number for each row: of its recording, or of its part of the only one.

    A part is easier to predict from the rest of its own recording than another recording is.
    """
    parts = 1 if len(lengths) > 1 else _PARTS
    pairs = enumerate(lengths)
    return np.concatenate([place * parts + np.arange(n) * parts // n for place, n in pairs])
