"""Covariance that holds where the prediction errors are not quite white.

An encoder that turns by nearly a whole number of counts a sample repeats its rounding error for
many samples. The information matrix takes each sample as news; the sandwich weighs the scores by
their own autocovariance (Newey and West, Econometrica 55 (1987) 703-708).
"""

from __future__ import annotations

import numpy as np

from drill_env._threads import each
from drill_env._types import FloatArray
from drill_env.identification.coordinates import inverse
from drill_env.identification.descent import Point, Problem
from drill_env.identification.prediction_error import path_of
from drill_env.parameters import SYMBOLS

_LAG_S = 0.25


def sandwich_covariance(problem: Problem, point: Point) -> FloatArray:
    """Covariance of the coordinates at the likelihood's lowest point, shape (free, free)."""
    bread = inverse(point.information)
    meats = each(lambda i: _meat(problem, point, i), range(len(problem.samples)))
    meat = np.sum(meats, axis=0)
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


def _meat(problem: Problem, point: Point, index: int) -> FloatArray:
    samples, starts = problem.samples[index], point.starts[index]
    noise = point.noise[problem.groups[index]]
    path = path_of(samples, point.rig, noise, starts, problem.robust, slopes=True)
    places = [SYMBOLS.index(name) for name in problem.coordinates.free]
    slopes = path.slopes[:, :, places] @ problem.coordinates.jacobian(point.vector)
    edges = [*samples.restarts.tolist(), len(samples.t)]
    outer = []
    for window, column in zip(*np.nonzero(samples.spreads), strict=True):
        part = np.zeros(path.rows["white"].shape)
        span = slice(edges[window], edges[window + 1])
        part[span] = path.slopes[span, :, len(SYMBOLS) + column]
        outer.append(part)
    scores = _reduced(np.moveaxis(slopes, 2, 0), np.array(outer), path.rows["white"])
    return _newey_west(scores, max(1, round(_LAG_S / samples.recording.interval)))


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
