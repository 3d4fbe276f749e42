"""Log densities of held-out readings, each predicted from those before it, in blocks."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from drill_env._threads import each
from drill_env._types import FloatArray, IntArray
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.held_out import followed
from drill_env.identification.samples import Samples
from drill_env.prediction.likelihood import scales

# Seconds within which innovations are taken as one: about a period of the string.
_BLOCK = 5.0


@dataclass(frozen=True, slots=True, eq=False)
class HeldOut:
    """Recordings that were not fitted, and how likely fits make their readings.

    Attributes:
        samples: the recordings.
        setting: of the fits.
        degrees: of freedom of Student's t.
        known: of each fit that was asked, see `blocks`.
    """

    samples: Sequence[Samples]
    setting: Setting
    degrees: float
    known: dict[Fit, FloatArray] = field(default_factory=dict)

    def blocks(self, fit: Fit) -> FloatArray:
        """Log density of the readings in each block of all recordings, nats, shape (blocks,)."""
        self.ask([fit])
        return self.known[fit]

    def ask(self, fits: Sequence[Fit]) -> None:
        """Have the blocks of several fits, each predicted once."""
        fresh = [fit for fit in dict.fromkeys(fits) if fit not in self.known]

        def densities(job: tuple[Fit, Samples]) -> FloatArray:
            return block_densities(job[1], self.setting, job[0], self.degrees)

        parts = iter(each(densities, itertools.product(fresh, self.samples)))
        for fit in fresh:
            own = [next(parts) for _ in self.samples]
            self.known[fit] = np.concatenate(own) if own else np.zeros(0)

    def marks(self) -> list[int]:
        """Which recording each block is of."""
        return [i for i, s in enumerate(self.samples) for _ in range(block_count(s))]


def block_densities(samples: Samples, setting: Setting, fit: Fit, degrees: float) -> FloatArray:
    """Log density of the readings in each block of a recording, nats, shape (blocks,).

    Its scale is the most likely one of the recording, as windows of an axis have one. By the
    filter's own, which is that of a normal density, whichever fit came to a little less noise would
    gain; by that of the fitted recordings a better fit could lose where others are disturbed more.

    Args:
        samples: the recording.
        setting: of the fit.
        fit: whose filter predicts.
        degrees: of freedom of Student's t.
    """
    trace = followed(samples, setting, fit)[2].trace
    size = _scales(trace.standardised, degrees)
    tail = (degrees + 1.0) * np.log1p((trace.standardised / size) ** 2 / degrees)
    with np.errstate(divide="ignore"):
        level = np.log(trace.variance * size**2)
    density = np.where(trace.variance > 0.0, -0.5 * (tail + level), np.nan)
    places, count = _places(samples), block_count(samples)
    out = np.zeros(count)
    for read, found in zip(samples.angles.T, density.T, strict=True):
        asked = np.bincount(places[np.isfinite(read)], minlength=count)
        known = np.isfinite(found)
        told = np.bincount(places[known], minlength=count)
        total = np.bincount(places[known], found[known], minlength=count)
        # Readings that a candidate takes out are as likely as the others of their block.
        out += np.where(told > 0, total * asked / np.maximum(told, 1), 0.0)
    return out


def _scales(innovations: FloatArray, degrees: float) -> FloatArray:
    """Of each reading's innovations, in the filter's deviations."""
    known = [one[np.isfinite(one)] for one in innovations.T]
    return np.array([scales(e[:, None, None], degrees)[0, 0] if len(e) else 1.0 for e in known])


def block_count(samples: Samples) -> int:
    """How many blocks a recording has."""
    return max(int(samples.t[-1] / _BLOCK), 1)


def _places(samples: Samples) -> IntArray:
    """The block that each row is in, the rest of a recording in its last whole one."""
    return np.minimum((samples.t / _BLOCK).astype(np.int64), block_count(samples) - 1)
