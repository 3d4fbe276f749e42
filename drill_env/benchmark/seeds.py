"""Aggregates over training seeds: interquartile mean with stratified bootstrap intervals.

Agarwal et al., "Deep reinforcement learning at the edge of the statistical precipice", NeurIPS
2021; the same numbers as their package rliable, of which only these two are needed.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import trim_mean

from drill_env._errors import InputError
from drill_env._types import FloatArray

_RESAMPLES = 10_000


def interquartile_mean(scores: FloatArray) -> float:
    """Mean of the middle half of all scores, whatever seed and task they belong to."""
    return float(trim_mean(np.asarray(scores, dtype=float), 0.25, axis=None))


def stratified_interval(
    scores: FloatArray, seed: int = 0, resamples: int = _RESAMPLES, level: float = 0.95
) -> tuple[float, float]:
    """Percentile interval of the interquartile mean; seeds are drawn anew within each task.

    Args:
        scores: one row a training seed, one column a task, shape (seeds, tasks).
        seed: of the draws.
        resamples: number of draws.
        level: coverage, between 0 and 1.

    Raises:
        InputError: there are fewer than two seeds.
    """
    scores = np.asarray(scores, dtype=float)
    if scores.ndim != 2 or len(scores) < 2:
        raise InputError("an interval over seeds needs two or more: scores of shape (seeds, tasks)")
    rng = np.random.default_rng(seed)
    drawn = rng.integers(0, len(scores), (resamples, *scores.shape))
    picked = np.take_along_axis(scores[None], drawn, axis=1).reshape(resamples, -1)
    means = trim_mean(picked, 0.25, axis=1)
    low, high = np.quantile(means, [0.5 - 0.5 * level, 0.5 + 0.5 * level])
    return float(low), float(high)
