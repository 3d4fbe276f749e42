"""Single readings that no disc made: they jump away and are back at the next row."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import median_abs_deviation

from drill_env._types import BoolArray, FloatArray
from drill_env.identification.samples import Samples

# Deviations of the other readings from which one is a glitch. The filter weighs what is smaller,
# see `Setting.robust`; a normal reading is so far off once in 1e23.
_FAR = 10.0
# How far a glitch's neighbours may be from the half of it by which it spoils their comparison, as
# a share of it: between these and those of a kink, 0, or of a lasting jump, the whole, lies half.
_ALIKE = 0.25


def glitches(t: FloatArray, values: FloatArray, step: float) -> BoolArray:
    """Rows of a channel at which one reading alone is off, both neighbours being where they were.

    A knock bends the way and a lost count shifts all that follows; neither comes back at once.

    Args:
        t: times, s, shape (n,).
        values: readings, NaN where missing, shape (n,).
        step: a count of the sensor, in the readings' unit; 0 where it has none.

    Returns:
        Shape (n,).
    """
    found = np.zeros(len(t), dtype=np.bool_)
    known = np.flatnonzero(np.isfinite(values))
    if len(known) < 5:
        return found
    x, at = values[known], t[known]
    share = (at[1:-1] - at[:-2]) / (at[2:] - at[:-2])
    off = x[1:-1] - (1.0 - share) * x[:-2] - share * x[2:]
    before, here, after = off[:-2], off[1:-1], off[2:]
    spoilt = np.maximum(np.abs(before + 0.5 * here), np.abs(after + 0.5 * here))
    usual = max(float(median_abs_deviation(off, scale="normal")), step)
    found[known[2:-2]] = (np.abs(here) > _FAR * usual) & (spoilt < _ALIKE * np.abs(here))
    return found


def without_glitches(samples: Samples) -> Samples:
    """The recording with its glitches missing."""
    quanta, angles = samples.recording.quanta, samples.angles.copy()
    for place, name in enumerate(samples.names):
        angles[glitches(samples.t, angles[:, place], quanta.get(name, 0.0)), place] = np.nan
    return replace(samples, angles=angles)
