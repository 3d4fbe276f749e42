"""What is known of parameters before a fit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.parameters import Rig


@dataclass(frozen=True, slots=True, eq=False)
class Prior:
    """A normal distribution of some parameters.

    Attributes:
        names: the parameters.
        mean: their means, shape (n,).
        precision: inverse of their covariance, shape (n, n).
    """

    names: tuple[str, ...] = ()
    mean: FloatArray = field(default_factory=lambda: np.zeros(0))
    precision: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))

    @classmethod
    def independent(cls, values: Mapping[str, tuple[float, float]]) -> Prior:
        """From the mean and standard deviation of each parameter.

        Raises:
            InputError: a standard deviation is not greater than 0.
        """
        for name, (_, deviation) in values.items():
            if not (math.isfinite(deviation) and deviation > 0):
                raise InputError(
                    f"prior of {name}: its standard deviation is {deviation}, give more than 0"
                )
        means = np.array([mean for mean, _ in values.values()])
        return cls(tuple(values), means, np.diag([s**-2 for _, s in values.values()]))

    def precision_of(self, names: Sequence[str]) -> FloatArray:
        """The precision in another order, 0 for parameters it says nothing of."""
        places = [self.names.index(name) if name in self.names else -1 for name in names]
        padded = np.pad(self.precision, ((0, 1), (0, 1)))
        return padded[np.ix_(places, places)]

    def miss(self, rig: Rig, names: Sequence[str]) -> FloatArray:
        """Mean minus value for each of the names, 0 where it says nothing."""
        means = dict(zip(self.names, self.mean.tolist(), strict=True))
        values = [getattr(rig, name) for name in names]
        return np.array([means.get(n, v) - v for n, v in zip(names, values, strict=True)])
