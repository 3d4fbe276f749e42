"""Whether a sum of paired differences is more than chance.

The paired randomisation test (Fisher, The Design of Experiments, 1935, section 21): if neither of
two models predicts better, each difference might as well have had the other sign. No scale is
estimated, so one block that a model predicts far better than the other does not make the rest
uncertain, as it does in a t test, and a handful of blocks are not taken for many.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtri_exp, stdtr

from drill_env._types import FloatArray

# Beyond this share of the largest sum all signs are taken to be alike.
_ALL = 1.0 - 1e-9


def z_of_sum(differences: FloatArray) -> float:
    """Standard normal deviate as improbable as a sum of differences with random signs.

    By the saddlepoint approximation (Robinson, Journal of the Royal Statistical Society B 44,
    1982). The largest possible, of n differences of one sign, has a chance of one in 2^n.

    Args:
        differences: shape (n,).

    Returns:
        Positive where the sum is; 0 without a difference.
    """
    size = float(np.abs(differences).max(initial=0.0))
    if size == 0.0 or not math.isfinite(size):
        return 0.0
    d = np.abs(differences[differences != 0.0]) / size
    total, most = float(differences.sum()) / size, float(d.sum())
    share = abs(total) / most
    if share < 1e-9:
        return 0.0
    rarest = -float(ndtri_exp(-len(d) * math.log(2.0)))
    if share > _ALL:
        return math.copysign(rarest, total)
    s = _saddlepoint(d, share * most)
    r = math.sqrt(2.0 * max(s * share * most - float(_log_cosh(s * d).sum()), 0.0))
    v = s * math.sqrt(float(np.sum((d / np.cosh(np.minimum(s * d, 300.0))) ** 2)))
    if r < 1e-4 or v == 0.0:
        return math.copysign(r, total)
    # Barndorff-Nielsen's form of it.
    return math.copysign(min(max(r + math.log(v / r) / r, 0.0), rarest), total)


def z_of_groups(differences: FloatArray, groups: Sequence[int]) -> float:
    """Standard normal deviate as improbable as differences that agree over groups.

    Each group counts by how clear it is in itself, not by its sum: a group in which there is more
    to gain is no scatter. The smaller of what the groups come to together if their members are
    independent (Stouffer et al., The American Soldier, 1949) and of Student's t over them, since
    members of one group share an error.

    Args:
        differences: shape (n,).
        groups: which each is of, shape (n,), of two or more.
    """
    which = np.asarray(groups)
    each = np.array([z_of_sum(differences[which == name]) for name in np.unique(which)])
    count, scatter = len(each), float(np.std(each, ddof=1))
    if scatter == 0.0:
        return float(each.sum()) / math.sqrt(count)
    t = math.sqrt(count) * float(each.mean()) / scatter
    return min(float(each.sum()) / math.sqrt(count), _normal(t, count - 1))


def _normal(t: float, degrees: int) -> float:
    """The standard normal deviate that is as rare as one of Student's."""
    return -float(np.sign(t) * ndtri_exp(math.log(max(float(stdtr(degrees, -abs(t))), 1e-300))))


def _log_cosh(x: FloatArray) -> FloatArray:
    return np.logaddexp(x, -x) - math.log(2.0)


def _saddlepoint(d: FloatArray, total: float) -> float:
    """Tilt at which signs drawn at random have that sum in the mean."""

    def beyond(s: float) -> float:
        return float(np.sum(d * np.tanh(s * d))) - total

    far = 1.0
    while beyond(far) < 0.0 and far < 1e12:
        far *= 2.0
    return float(brentq(beyond, 0.0, far))
