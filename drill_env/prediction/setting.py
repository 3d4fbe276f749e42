"""What fits are made to: the given rig, how well it is known, and the windows of recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drill_env._types import FloatArray
from drill_env._watch import never
from drill_env.identification.coordinates import POSITIVE, Coordinates
from drill_env.parameters import Rig
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.cut import Cut
from drill_env.prediction.given import Given, given_numbers, moved


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """What fits are made to.

    Its coordinates are those of the rig's free parameters, then those of the numbers of its given
    effects, then the drive's shift in sampling intervals.

    Attributes:
        start: the given rig, its effects among it.
        free: names of its free parameters.
        doubt: relative standard deviation of these and of its effects' numbers.
        cuts: recordings.
        criteria: how they are judged.
        over: whether descents are to end where they are.
    """

    start: Rig
    free: tuple[str, ...]
    doubt: float
    cuts: tuple[Cut, ...]
    criteria: Criteria
    over: Callable[[], bool] = never

    @property
    def coordinates(self) -> Coordinates:
        """Of the free parameters."""
        return Coordinates(self.start, self.free)

    @property
    def given(self) -> tuple[Given, ...]:
        """Numbers of the given effects."""
        return given_numbers(self.start)

    @property
    def names(self) -> tuple[str, ...]:
        """Of all coordinates but the shift."""
        return (*self.free, *(one.label for one in self.given))

    @property
    def shift(self) -> int:
        """Place of the shift."""
        return len(self.free) + len(self.given)

    @property
    def centre(self) -> FloatArray:
        """The given rig and no shift of the drive."""
        return np.append(self.coordinates.vector(self.start), np.zeros(len(self.given) + 1))

    @property
    def spread(self) -> FloatArray:
        """Standard deviations around it."""
        level = {"dTsu": self.start.Tsu, "dbu": self.start.bu}
        values = self.coordinates.vector(self.start).tolist()
        sizes = [
            1.0 if name in POSITIVE else max(2.0 * abs(value), level.get(name, 0.0), 1e-6)
            for name, value in zip(self.free, values, strict=True)
        ]
        sizes += [1.0] * len(self.given)
        return np.append(self.doubt * np.array(sizes), self.criteria.shift)

    def rig(self, x: FloatArray, added: Sequence[Mapping[str, Any]] = ()) -> Rig:
        """The rig at some coordinates, with further effects.

        Raises:
            InputError: there is none.
        """
        count = len(self.free)
        effects = moved(self.start.effects, self.given, x[count : self.shift])
        return self.coordinates.rig(x[:count]).replace(effects=(*effects, *added))
