"""Covariance that holds where the prediction errors are not quite white.

An encoder that turns by nearly a whole number of counts a sample repeats its rounding error for
many samples. The information matrix takes each sample as news; the sandwich weighs the scores by
their own autocovariance (Newey and West, Econometrica 55 (1987) 703-708).
"""

from __future__ import annotations

import math
import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from drill_env._types import FloatArray
from drill_env.identification.coordinates import inverse
from drill_env.identification.descent import Point, Problem
from drill_env.identification.noise import NoiseModel
from drill_env.identification.prediction_error import Samples, trace_of
from drill_env.parameters import Rig

_LAG_S = 0.25
# Share of a standard deviation by which coordinates are moved for a central difference.
_MOVE = 0.05
_START_MOVE = 1e-6


def sandwich_covariance(problem: Problem, point: Point) -> FloatArray:
    """Covariance of the coordinates at the likelihood's lowest point, shape (free, free)."""
    bread = inverse(point.information)
    sizes = _MOVE * np.sqrt(np.diag(bread))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        meats = pool.map(lambda i: _meat(problem, point, i, sizes), range(len(problem.samples)))
        meat = np.sum(list(meats), axis=0)
    return bread @ _widened(point.information, meat) @ bread


def _widened(information: FloatArray, meat: FloatArray) -> FloatArray:
    """The scores' covariance, but nowhere below the information: priors have no scores."""
    size = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    scaled = meat * np.outer(size, size)
    whole = information * np.outer(size, size)
    values, vectors = np.linalg.eigh(whole)
    root = vectors * np.sqrt(np.maximum(values, 1e-300))
    back = vectors / np.sqrt(np.maximum(values, 1e-300))
    factors, axes = np.linalg.eigh(back.T @ scaled @ back)
    fixed = root @ (axes * np.maximum(factors, 1.0)) @ axes.T @ root.T
    return fixed / np.outer(size, size)


def _meat(problem: Problem, point: Point, index: int, sizes: FloatArray) -> FloatArray:
    samples, starts = problem.samples[index], point.starts[index]
    noise = point.noise[problem.groups[index]]
    base = trace_of(samples, point.rig, noise, starts, problem.robust)
    deviation = np.sqrt(np.where(base.variance > 0, base.variance, math.inf))
    white = np.clip(base.innovation / deviation, -problem.robust, problem.robust)
    slopes = []
    for i, size in enumerate(sizes):
        move = np.zeros(len(sizes))
        move[i] = size
        rigs = [problem.coordinates.rig(point.vector + s * move) for s in (1.0, -1.0)]
        slopes.append(_slope(samples, rigs, noise, [starts, starts], 2.0 * size) / deviation)
    outer = []
    for row, column in zip(*np.nonzero(samples.spreads), strict=True):
        move = np.zeros_like(starts)
        move[row, column] = _START_MOVE
        both = [starts + move, starts - move]
        outer.append(_slope(samples, [point.rig] * 2, noise, both, 2.0 * _START_MOVE) / deviation)
    scores = _reduced(np.array(slopes), np.array(outer), white)
    return _newey_west(scores, max(1, round(_LAG_S / samples.recording.interval)))


def _slope(
    samples: Samples, rigs: list[Rig], noise: NoiseModel, starts: list[FloatArray], span: float
) -> FloatArray:
    above, below = (
        trace_of(samples, rig, noise, start) for rig, start in zip(rigs, starts, strict=True)
    )
    return -(above.innovation - below.innovation) / span


def _reduced(slopes: FloatArray, outer: FloatArray, white: FloatArray) -> FloatArray:
    """Scores of the coordinates with the starts eliminated, shape (rows, free)."""
    flat = slopes.reshape(len(slopes), -1)
    if len(outer):
        other = outer.reshape(len(outer), -1)
        flat = flat - (flat @ other.T) @ np.linalg.pinv(other @ other.T, hermitian=True) @ other
    return (flat.reshape(slopes.shape) * white).sum(axis=2).T


def _newey_west(scores: FloatArray, lag: int) -> FloatArray:
    total = scores.T @ scores
    for k in range(1, lag + 1):
        part = scores[k:].T @ scores[:-k]
        total += (1.0 - k / (lag + 1.0)) * (part + part.T)
    return total
