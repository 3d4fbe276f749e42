"""Models compared by their prediction of recordings that they were not fitted to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drill_env._types import FloatArray
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.randomisation import z_of_groups, z_of_sum

_DRAWS = 4000
# Recordings from which each counts as one observation. That all of three gain by chance is no rare
# thing, one in eight.
_COUNTED, _SEVERAL = 3, 4


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """One model beside the one without it, as in `arviz.compare`.

    Attributes:
        id: of the candidate.
        gain: log density of all unseen windows less that of the model without it, nats.
        error: standard error of the gain.
        z: how clear it is, see `z_of`.
        by_lead: the gain at each lead.
        numbers: how many it has.
        windows: gain of each unseen window, shape (w,).
        weight: probability among the listed models, see `weighed`; 0 where it is not listed.
        leads: at how many each window was predicted.
        recordings: which recording each window is of; of one where there are none.
    """

    id: str
    gain: float
    error: float
    z: float
    by_lead: tuple[float, ...]
    numbers: int
    windows: FloatArray
    weight: float = 0.0
    leads: int = 1
    recordings: tuple[int, ...] = ()


def row_of(name: str, numbers: int, gains: FloatArray, recordings: Sequence[int]) -> Row:
    """Compare one model with the one without it.

    Args:
        name: of the candidate.
        numbers: how many it has.
        gains: of each unseen window at each lead, nats, shape (w, k).
        recordings: which recording each window is of, shape (w,).
    """
    windows = gains.sum(axis=1)
    error = standard_error(windows, recordings)
    gain = float(windows.sum())
    z = z_of(windows, recordings)
    by_lead = tuple(gains.sum(axis=0).tolist())
    return Row(
        name, gain, error, z, by_lead, numbers, windows, leads=gains.shape[1],
        recordings=tuple(recordings),
    )  # fmt: skip


def difference(one: Row, other: Row) -> Row:
    """One model beside another that predicted the same windows."""
    windows = one.windows - other.windows
    recordings = one.recordings or [0] * len(windows)
    return row_of(one.id, one.numbers, windows[:, np.newaxis], recordings)


def z_of(windows: FloatArray, recordings: Sequence[int]) -> float:
    """How many standard deviations a sum over windows is off chance.

    Beside one window that a model predicts far better, the standard error makes nothing of all the
    others, and beside one recording in which there is more to gain, of all other recordings. So the
    sum also stands where its signs are as clear, those of all windows of one or two recordings, or
    of each of four and more (`randomisation.py`). On chance of windows the larger of the two is
    above 3 no more often than the first is on normal chance; where recordings share an error it is
    in at most 35 of 1000 draws, the first in 39.

    Args:
        windows: gain of each, nats, shape (w,).
        recordings: which recording each is of, shape (w,).
    """
    error, total = standard_error(windows, recordings), float(windows.sum())
    z = total / error if error > 0.0 else 0.0
    if total <= 0.0 or len(windows) < 2:
        return z
    count = len(set(recordings))
    if count < _SEVERAL:
        return max(z, z_of_sum(windows)) if count < _COUNTED else z
    return max(z, z_of_groups(windows, recordings))


def standard_error(windows: FloatArray, recordings: Sequence[int]) -> float:
    """Of a sum over windows: the larger of that from windows and that from recordings.

    Windows of one recording share the error of their model.
    """
    count = len(windows)
    if count < 2:
        return math.inf
    error = math.sqrt(count * float(np.var(windows, ddof=1)))
    which = np.asarray(recordings)
    names = np.unique(which)
    if len(names) >= _COUNTED:
        # Each recording's mean stands for all of its windows.
        sums = np.array([windows[which == name].sum() for name in names])
        share = np.array([(which == name).sum() for name in names]) / count
        error = max(error, math.sqrt(float(np.sum((sums - share * windows.sum()) ** 2))))
    return error


def listed(row: Row, criteria: Criteria) -> bool:
    """Whether unseen windows ask for a model at all."""
    return row.gain >= criteria.gain and row.z >= criteria.z


def weighed(rows: Sequence[Row], odds: Sequence[float], seed: int = 0) -> FloatArray:
    """Probabilities of models that exclude each other.

    Pseudo-BMA with the Bayesian bootstrap over windows (Yao, Vehtari, Simpson and Gelman, Bayesian
    Analysis 13, 2018), over recordings where there are more than two, as windows of one recording
    share the error of their model; times the prior odds. A number costs one nat (Akaike).
    The gains of a window are divided by how many leads it was predicted at, though they are of its
    mean log density already: to a power below 1, as the likelihoods of models that all err are
    too sure of the least wrong one (Gruenwald and van Ommen, Bayesian Analysis 12, 2017, who learn
    that power; here it is not).

    Args:
        rows: the models.
        odds: prior odds of each.
        seed: of the bootstrap.

    Returns:
        Shape (m,).
    """
    if not rows:
        return np.zeros(0)
    gains = np.stack([row.windows / row.leads for row in rows])
    which = np.arange(gains.shape[1])
    if len(set(rows[0].recordings)) >= _COUNTED:
        which = np.unique(rows[0].recordings, return_inverse=True)[1]
    count = int(which.max()) + 1
    draws = np.random.default_rng(seed).dirichlet(np.ones(count), _DRAWS) * count
    draws = draws[:, which]
    prior = np.log(odds) - np.array([row.numbers for row in rows])
    log = draws @ gains.T + prior
    share = np.exp(log - log.max(axis=1, keepdims=True))
    share /= share.sum(axis=1, keepdims=True)
    return np.asarray(share.mean(axis=0), dtype=np.float64)
