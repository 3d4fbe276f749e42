"""What the recordings say of one term: latent torques against the coordinate of its law."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drill_env._types import FloatArray, IntArray
from drill_env.diagnosis.applied import with_terms
from drill_env.diagnosis.rounds import Found
from drill_env.diagnosis.shapes import middle
from drill_env.diagnosis.terms import Term
from drill_env.effects.along import Motion
from drill_env.identification.coordinates import inverse
from drill_env.identification.noise_of_recording import settled_starts
from drill_env.identification.prediction_error import path_of
from drill_env.identification.smoothing import smoothed
from drill_env.report._law_coordinate import TURN, cycles_of, law_coordinate

_BINS, _DRAWS, _FEWEST_BLOCKS = 32, 40, 4
_BLOCK = 1.0
_SLOW = 0.02
# The law must explain so much more of its torque when turned.
_CLEARER = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Means over bins of a coordinate, with 95 % intervals; each of shape (bins,)."""

    x: FloatArray
    mean: FloatArray
    low: FloatArray
    high: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """One term as the fitted recordings show it.

    Attributes:
        term: of the final fit.
        disc: 0 for the upper, 1 for the lower one.
        without: latent torque on that disc in each recording, the term unknown, Nm, each (n,).
        left: the same once the term is known.
        acts: what the term itself does there, Nm or rad, each (n,).
        coordinate: in words, with unit.
        turned: in words, which torques are drawn as positive; empty for all as they are.
        points: latent torque over the coordinate, the term unknown.
        rest: the same once the term is known.
        law: the term over the coordinate, with the band of its numbers.
        senses: whether the term is an error of reading (rad) and no torque.
    """

    term: Term
    disc: int
    without: tuple[FloatArray, ...]
    left: tuple[FloatArray, ...]
    acts: tuple[FloatArray, ...]
    coordinate: str
    turned: str
    points: Points
    rest: Points
    law: Points
    senses: bool


@dataclass(frozen=True, slots=True, eq=False)
class _Bins:
    """Rows of all recordings sorted into bins of a coordinate and blocks of time."""

    place: IntArray
    block: IntArray
    keep: np.ndarray
    x: FloatArray


def latent_torques(found: Found, terms: tuple[Term, ...]) -> tuple[FloatArray, ...]:
    """Smoothed latent torques of the fitted recordings when only these terms are known.

    The noise is that of the rig alone, wide enough to follow what is missing.

    Returns:
        For each recording, Nm, shape (n, 2).
    """
    rig, noise = found.final.rig, found.base.noise
    out = []
    for samples, motion in zip(found.setting.samples, found.final.motions, strict=True):
        given = with_terms(samples, terms, rig, motion)
        starts = settled_starts(given, rig, noise)
        path = path_of(given, rig, noise, starts, found.setting.robust)
        out.append(smoothed(given, noise, path).states[:, 4:])
    return tuple(out)


def evidence(found: Found, term: Term, left: tuple[FloatArray, ...]) -> Evidence:
    """What the fitted recordings say of a term of the final fit.

    Args:
        found: the search.
        term: of its final fit.
        left: latent torques when all terms are known.
    """
    rig, motions = found.final.rig, found.final.motions
    others = tuple(t for t in found.final.terms if t is not term)
    responses = [term.source.response(term.q, rig, m) for m in motions]
    senses = not any(np.any(torque) for torque, _ in responses)
    both = [error if senses else torque for torque, error in responses]
    disc = int(np.argmax([sum(float(np.sum(r[:, d] ** 2)) for r in both) for d in (0, 1)]))
    without = tuple(d[:, disc] for d in latent_torques(found, others))
    acts = tuple(r[:, disc] for r in both)
    words, values = law_coordinate(term, motions)
    bins = _sorted_into(values, motions, disc, ring=cycles_of(term) is not None)
    turned, turn = ("", np.ones(len(bins.place))) if senses else _turned(bins, acts, motions, disc)
    return Evidence(
        term, disc, without, tuple(d[:, disc] for d in left), acts, words, turned,
        _means(bins, turn * np.concatenate(without)),
        _means(bins, turn * np.concatenate([d[:, disc] for d in left])),
        _law(found, term, bins, turn, disc, senses=senses), senses,
    )  # fmt: skip


def _turned(
    bins: _Bins, acts: tuple[FloatArray, ...], motions: tuple[Motion, ...], disc: int
) -> tuple[str, FloatArray]:
    """The signs that show a torque as a function of the coordinate, and what they stand for."""
    ways = {"": [np.ones(len(m.t)) for m in motions]}
    ways["against the motion"] = [-np.sign(middle(m.states[:, 1 + disc])) for m in motions]
    if disc == 0:
        ways["along the voltage"] = [np.sign(m.u) for m in motions]
    signs = {words: np.concatenate(way) for words, way in ways.items()}
    told = {words: _explained(bins, s * np.concatenate(acts)) for words, s in signs.items()}
    told[""] += _CLEARER
    best = max(told, key=lambda words: told[words])
    return best, signs[best]


def _sorted_into(
    values: list[FloatArray], motions: tuple[Motion, ...], disc: int, *, ring: bool
) -> _Bins:
    joined = np.concatenate(values)
    if ring:
        edges = np.linspace(0.0, TURN, _BINS + 1)
    else:
        # Between quantiles and even spacing, as the free shapes have their knots.
        shares = np.linspace(0.002, 0.998, _BINS + 1)
        ends = np.quantile(joined, [shares[0], shares[-1]])
        even = np.linspace(ends[0], ends[1], _BINS + 1)
        edges = np.unique(0.5 * (np.quantile(joined, shares) + even))
    place = np.clip(np.searchsorted(edges, joined, side="right") - 1, 0, max(len(edges) - 2, 0))
    block = np.concatenate(
        [1_000_000 * i + (m.t / _BLOCK).astype(np.int64) for i, m in enumerate(motions)]
    )
    # At rest friction takes whatever torque there is.
    keep = np.concatenate([np.abs(m.states[:, 1 + disc]) > _SLOW for m in motions])
    if not keep.any():
        keep[:] = True
    count = np.maximum(np.bincount(place[keep], minlength=_BINS), 1)
    x = np.bincount(place[keep], joined[keep], minlength=_BINS) / count
    return _Bins(place, block, keep, x)


def _averages(bins: _Bins, values: FloatArray) -> FloatArray:
    place, values = bins.place[bins.keep], values[bins.keep]
    count = np.bincount(place, minlength=_BINS)
    total = np.bincount(place, values, minlength=_BINS)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _explained(bins: _Bins, values: FloatArray) -> float:
    """Share of the sum of squares that the means over the bins explain."""
    kept = values[bins.keep]
    fitted = _averages(bins, values)[bins.place[bins.keep]]
    return 1.0 - float(np.sum((kept - fitted) ** 2)) / (float(np.sum(kept**2)) or 1.0)


def _means(bins: _Bins, values: FloatArray) -> Points:
    """Means over the bins; neighbouring rows are alike, so whole blocks of time count as one."""
    mean = _averages(bins, values)
    error = np.full(_BINS, np.nan)
    for i in range(_BINS):
        rows = bins.keep & (bins.place == i)
        _, block = np.unique(bins.block[rows], return_inverse=True)
        weight = np.bincount(block)
        if len(weight) < _FEWEST_BLOCKS:
            mean[i] = np.nan
            continue
        gaps = np.bincount(block, values[rows] - mean[i])
        error[i] = 1.96 * np.sqrt(np.sum(gaps**2)) / weight.sum()
    ok = np.isfinite(mean)
    return Points(bins.x[ok], mean[ok], (mean - error)[ok], (mean + error)[ok])


def _law(
    found: Found, term: Term, bins: _Bins, turn: FloatArray, disc: int, *, senses: bool
) -> Points:
    """The term over the coordinate and where 95 % of what its numbers may be put it."""
    fit = found.final

    def curve(q: FloatArray) -> FloatArray:
        responses = [term.source.response(q, fit.rig, m)[int(senses)][:, disc] for m in fit.motions]
        return _averages(bins, turn * np.concatenate(responses))

    begin = len(fit.vector)
    for other in fit.terms:
        if other is term:
            break
        begin += len(other.q)
    rows = slice(begin, begin + len(term.q))
    covariance = inverse(fit.information)[rows, rows]
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    shifts = np.random.default_rng(0).standard_normal((_DRAWS, len(term.q))) @ root.T
    curves = np.array([curve(term.source.bounded(term.q + s)) for s in shifts])
    middle_curve = curve(term.q)
    ok = np.isfinite(middle_curve)
    low, high = np.quantile(curves[:, ok], [0.025, 0.975], axis=0)
    return Points(bins.x[ok], middle_curve[ok], low, high)
