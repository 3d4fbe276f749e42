"""How likely prediction errors are: Student's t with a scale of its own at every lead."""

from __future__ import annotations

import numpy as np

from drill_env._types import FloatArray

_ROUNDS = 30
# Median square of a t variable with four degrees of freedom, over its squared scale.
_MEDIAN = 0.5486
_LEAST = 1e-15
FAR = 1e6
"""Error that stands for a prediction that failed."""


def scales(
    errors: FloatArray, degrees: float, first: FloatArray | None = None,
    least: FloatArray | float = 0.0,
) -> FloatArray:  # fmt: skip
    """Most likely scales of the errors (Lange, Little and Taylor, JASA 84, 1989).

    Where a disc rests in most windows, these are predicted without any error, and the likelihood
    has no bound; below the error of the readings themselves no scale says more.

    Args:
        errors: of windows, leads and channels, shape (w, k, c).
        degrees: of freedom.
        first: scales to begin with, shape (k, c).
        least: of each channel, shape (c,).

    Returns:
        Shape (k, c).
    """
    start = np.sqrt(np.median(errors**2, axis=0) / _MEDIAN) if first is None else first
    least = np.maximum(least, _LEAST)
    size = np.maximum(start, least)
    for _ in range(_ROUNDS):
        weight = (degrees + 1.0) / (degrees + (errors / size) ** 2)
        size = np.maximum(np.sqrt(np.mean(weight * errors**2, axis=0)), least)
    return np.asarray(size, dtype=np.float64)


def log_density(errors: FloatArray, size: FloatArray, degrees: float) -> FloatArray:
    """Log density of each window in nats, without the constant, shape (w, k).

    Leads of one window are not independent: a window counts once, by their mean
    (Varin, Reid and Firth, Statistica Sinica 21, 2011). Channels add.
    """
    each = -np.log(size) - 0.5 * (degrees + 1.0) * np.log1p((errors / size) ** 2 / degrees)
    return np.asarray(each.sum(axis=2) / errors.shape[1], dtype=np.float64)


def weights(errors: FloatArray, size: FloatArray, degrees: float) -> FloatArray:
    """Weight of each error in the normal equations, shape as of the errors."""
    return (degrees + 1.0) / (degrees + (errors / size) ** 2) / errors.shape[1]
