"""A small network in plain numpy, so that shipped policies need no torch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drill_env._types import FloatArray


@dataclass(frozen=True, slots=True)
class Network:
    """Hidden layers with tanh, a linear last one.

    Args:
        weights: of each layer, shape (inputs, outputs).
        biases: of each layer, shape (outputs,).
    """

    weights: tuple[FloatArray, ...]
    biases: tuple[FloatArray, ...]

    @classmethod
    def of(cls, layers: Sequence[tuple[FloatArray, FloatArray]]) -> Network:
        """From (weights, biases) of each layer; they must fit each other.

        Raises:
            ValueError: shapes do not fit, or the last layer has more than one output.
        """
        weights = tuple(np.asarray(w, dtype=float) for w, _ in layers)
        biases = tuple(np.asarray(b, dtype=float) for _, b in layers)
        sizes = [w.shape for w in weights]
        fits = all(a[1] == b[0] for a, b in zip(sizes, sizes[1:], strict=False))
        if not (
            fits and all(b.shape == (w.shape[1],) for w, b in zip(weights, biases, strict=True))
        ):
            raise ValueError("layers do not fit each other")
        if not sizes or sizes[-1][1] != 1 or not all(np.isfinite(w).all() for w in weights):
            raise ValueError("not a network of one output")
        return cls(weights, biases)

    @property
    def inputs(self) -> int:
        """Features it reads."""
        return self.weights[0].shape[0]

    def __call__(self, features: FloatArray) -> FloatArray:
        """Output of each row of features, shape (n,)."""
        x = features
        for w, b in zip(self.weights[:-1], self.biases[:-1], strict=True):
            x = np.tanh(x @ w + b)
        return (x @ self.weights[-1] + self.biases[-1])[:, 0]
