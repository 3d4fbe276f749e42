"""Coordinates of a rig together with the numbers of the effects that its file holds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from drill_env._types import FloatArray
from drill_env.effects import LIBRARY
from drill_env.identification.coordinates import Coordinates
from drill_env.parameters import Rig
from drill_env.prediction.given import Given, moved


@dataclass(frozen=True, slots=True)
class RigCoordinates:
    """A smooth one-to-one map between what is fitted of a rig and a vector.

    Args:
        own: of the rig's free parameters, which come first.
        given: numbers of the effects in its file, in the order of their coordinates.
    """

    own: Coordinates
    given: tuple[Given, ...] = ()

    @property
    def base(self) -> Rig:
        """The rig as given."""
        return self.own.base

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the rig's free parameters."""
        return self.own.free

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all that is fitted."""
        return (*self.free, *(one.label for one in self.given))

    def vector(self, rig: Rig) -> FloatArray:
        """Coordinates of a rig with the same effects, shape (len(names),)."""
        numbers = [one.coordinate(float(rig.effects[one.place][one.name])) for one in self.given]
        return np.concatenate([self.own.vector(rig), numbers])

    def rig(self, vector: FloatArray) -> Rig:
        """The rig at coordinates, its effects included.

        Raises:
            InputError: the parameters there make no rig.
        """
        own = self.own.rig(vector[: len(self.free)])
        if not self.given:
            return own
        return own.replace(effects=tuple(moved(self.base.effects, self.given, self._last(vector))))

    def many_values(self, vectors: FloatArray) -> FloatArray:
        """What is fitted, at many coordinates, both of shape (n, len(names))."""
        own = self.own.many_values(vectors[:, : len(self.free)])
        last = vectors[:, len(self.free) :].copy()
        for place, one in enumerate(self.given):
            last[:, place] = [one.at(x) for x in last[:, place].tolist()]
        return np.hstack([own, last])

    def reach(self, vector: FloatArray) -> FloatArray:
        """How far a coordinate may sensibly move at once, shape (len(names),)."""
        own = self.own.reach(vector[: len(self.free)])
        # One of these is a share of a number, or a radian.
        return np.concatenate([own, np.full(len(self.given), 0.5)])

    def jacobian(self, vector: FloatArray) -> FloatArray:
        """Derivatives of the rig's own parameters by all coordinates, shape (free, names)."""
        own = self.own.jacobian(vector[: len(self.free)])
        return np.hstack([own, np.zeros((len(own), len(self.given)))])

    def of_effects(
        self, rig: Rig, slopes: Sequence[FloatArray]
    ) -> Iterator[tuple[int, FloatArray]]:
        """Places of the effects' coordinates, and derivatives by them.

        Args:
            rig: at the coordinates.
            slopes: derivatives by the numbers of each effect, their last axis.
        """
        for place, one in enumerate(self.given, start=len(self.free)):
            entry = rig.effects[one.place]
            names = [p.name for p in LIBRARY[one.effect].parameters]
            x = one.coordinate(float(entry[one.name]))
            yield place, one.slope(x) * slopes[one.place][..., names.index(one.name)]

    def _last(self, vector: FloatArray) -> FloatArray:
        return vector[len(self.free) :]
