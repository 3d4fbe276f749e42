"""Points at which an effect is scored: its grids, and peaks that the likelihood's slopes show."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np
from scipy.ndimage import uniform_filter1d

from drill_env._types import FloatArray
from drill_env.diagnosis.linearised import Known, Linearised
from drill_env.effects import Effect, EffectParameter
from drill_env.effects.along import Motion
from drill_env.parameters import Rig

_PEAKS = 3

_HIGHEST_HZ = 40.0

# Shares of the highest voltage: just below it, and all the way where the grid ends far below.
_TOPS = (0.99, 0.98, 0.965, 0.945, 0.92, 0.89)
_WIDE = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
# Largest voltage, and twist and speeds that are hardly exceeded, of the paper's rig at up to 5 V.
_DECLARED_FOR = {"voltage": 4.5, "omega_u": 8.0, "omega_l": 13.0, "twist": 7.0}
# Of what brakes the upper disc.
_BACK_EMF = (0.45, 0.9)

# Points of a grid beyond which a third of them is asked first, and how many of the best of these
# have their neighbours asked.
_DENSE, _CLIMBED = 100, 3

# Of one turn, for the search of orders.
_BINS = 512

MOST_PLACES = 2**25
"""Places of an even grid that is Fourier transformed: with its transform, its power and their
running means a gigabyte. 16 000 turns, or 46 hours at 100 Hz."""


def grid_of(effect: Effect, linearised: Linearised) -> list[FloatArray]:
    """Points of an effect's declared grids, with the peaks of frequency, order and time added."""
    axes, rig = [], linearised.fit.rig
    for p in effect.parameters:
        values = tuple(_scale(p, effect, linearised) * value for value in p.grid)
        if p.name == "frequency" and effect.id.endswith("_disturbance"):
            disc = 0 if effect.equation == "upper" else 1
            values = tuple(sorted({*values, *_frequencies(linearised, disc)}))
        if p.name == "order" and len(p.grid) > 4:
            values = tuple(sorted({*values, *_orders(linearised, p, effect)}))
        if p.name == "level":
            # A limit just below the highest voltage clips little, and little else shows it.
            top = max(float(np.abs(k.motion.u).max()) for k in linearised.known)
            shares = _TOPS if top < 2.0 * max(values) else (*_WIDE, *_TOPS)
            values = tuple(sorted({*values, *(share * top for share in shares)}))
        if p.name == "back_emf":
            # What brakes the upper disc may be the motor's back EMF wholly, or in part.
            values = tuple(share * abs(rig.bu / rig.km) for share in _BACK_EMF)
        if p.name == "time":
            end = max(float(k.motion.t[-1]) for k in linearised.known)
            values = tuple(np.arange(0.02, 0.99, 0.03) * end)
        axes.append(values)
    return [np.array(point) for point in itertools.product(*axes)]


def gains_over(
    points: Sequence[FloatArray], gains_of: Callable[[list[FloatArray]], Sequence[float]]
) -> FloatArray:
    """What each point of a grid gains, -inf for those that were not asked.

    Of a dense grid over several numbers a third is asked, evenly spread, then the neighbours of the
    best ones (a fractional factorial design; Box, Hunter and Hunter, Statistics for Experimenters,
    2nd ed. 2005, chapter 6).

    Args:
        points: the grid, row by row.
        gains_of: tells the gains of some points.
    """
    if len(points) <= _DENSE:
        return np.array(gains_of(list(points)), dtype=np.float64)
    places = np.stack([np.unique(axis, return_inverse=True)[1] for axis in np.array(points).T], 1)
    gains = np.full(len(points), -np.inf)
    first = np.flatnonzero(places.sum(axis=1) % 3 == 0)
    gains[first] = gains_of([points[i] for i in first.tolist()])
    best = first[np.argsort(-gains[first])[:_CLIMBED]]
    apart = (places[:, np.newaxis] != places[best]).sum(axis=2)
    near = np.setdiff1d(np.flatnonzero((apart == 1).any(axis=1)), first)
    gains[near] = gains_of([points[i] for i in near.tolist()])
    return gains


def _scale(p: EffectParameter, effect: Effect, linearised: Linearised) -> float:
    """Factor by which recordings are larger than those that the grids were declared for.

    Within the factor 2 that a grid's points are apart, or more, nothing is gained by it.
    """
    motions = [k.motion for k in linearised.known]
    if p.role != "shape":
        return 1.0
    if p.unit in ("V", "V/s"):
        size = max(float(np.abs(m.u).max()) for m in motions) / _DECLARED_FOR["voltage"]
    elif p.unit == "rad/s":
        disc = 1 if effect.equation == "lower" or effect.id.endswith("_lower") else 0
        size = _usual_size(motions, 1 + disc) / _DECLARED_FOR[("omega_u", "omega_l")[disc]]
    elif p.unit == "Nm/rad":
        size = linearised.fit.rig.Jl / Rig().Jl
    elif p.unit == "rad" and effect.component == "string":
        size = _usual_size(motions, 0) / _DECLARED_FOR["twist"]
    else:
        return 1.0
    return size if abs(np.log2(max(size, 1e-12))) > 1.0 else 1.0


def _usual_size(motions: Sequence[Motion], column: int) -> float:
    """Of a state, hardly exceeded."""
    return max(float(np.percentile(np.abs(m.states[:, column]), 95)) for m in motions)


def _frequencies(linearised: Linearised, disc: int) -> list[float]:
    """Frequencies (Hz) at which a torque would explain most, from the likelihood's slopes."""
    intervals = [k.samples.recording.interval for k in linearised.known]
    # Rows that are missing, and files of different rates, keep their place in time.
    end = max(float(k.motion.t[-1]) for k in linearised.known)
    interval = max(min(intervals), 2.0 * end / MOST_PLACES)
    places = [np.rint(k.motion.t / interval).astype(np.int64) for k in linearised.known]
    longest = max(int(place[-1]) for place in places) + 1
    size = 2 * longest
    total = np.zeros(longest + 1)
    for pull, place in zip(linearised.pull, places, strict=True):
        total += np.abs(np.fft.rfft(np.bincount(place, pull[:, disc], minlength=size))) ** 2
    hertz = np.fft.rfftfreq(size, interval)
    wide = max(int(0.02 * len(total)), 5)
    relative = total / (uniform_filter1d(total, wide, mode="constant") + 1e-300)
    relative[(hertz < 0.03) | (hertz > min(_HIGHEST_HZ, 0.45 / max(intervals)))] = 0.0
    found: list[float] = []
    for place in np.argsort(-relative)[:200]:
        value = float(hertz[place])
        if all(abs(value - other) > 3.0 / (longest * interval) for other in found):
            found.append(value)
        if len(found) == _PEAKS:
            break
    return [f + d / (longest * interval) for f in found for d in (-0.25, 0.0, 0.25)]


def _orders(linearised: Linearised, p: EffectParameter, effect: Effect) -> list[float]:
    """Orders in theta_u at which a torque on the upper disc would explain most.

    A share of the drive acts by the voltage.
    """
    share = any(other.role == "amplitude" and other.unit == "1" for other in effect.parameters)
    pulls = [
        pull[:, 0] * (known.motion.u if share else 1.0)
        for pull, known in zip(linearised.pull, linearised.known, strict=True)
    ]
    spans = [_turned(known) for known in linearised.known]
    longest = max(float(np.ptp(angle)) for angle in spans) + 1.0
    bins = min(float(_BINS), np.pi * MOST_PLACES / longest)
    lowest, highest = p.grid[0], min(1.5 * p.grid[-1], bins / 4.0)
    size = int(2 ** np.ceil(np.log2(2.0 * longest * bins / (2.0 * np.pi))))
    total = np.zeros(size // 2 + 1)
    for pull, angle in zip(pulls, spans, strict=True):
        place = np.floor((angle - angle.min()) * bins / (2.0 * np.pi)).astype(np.int64)
        binned = np.bincount(place, weights=pull, minlength=size)[:size]
        total += np.abs(np.fft.rfft(binned)) ** 2
    order = np.arange(len(total)) * bins / size
    wide = max(int(0.02 * len(total)), 5)
    relative = total / (uniform_filter1d(total, wide, mode="constant") + 1e-300)
    relative[(order < lowest) | (order > highest)] = 0.0
    apart = 4.0 * np.pi / longest
    found: list[float] = []
    for place in np.argsort(-relative)[:200]:
        value = float(order[place])
        if all(abs(value - other) > apart for other in found):
            found.append(value)
        if len(found) == _PEAKS:
            break
    return [n + d * apart for n in found for d in (-0.25, 0.0, 0.25)]


def _turned(known: Known) -> FloatArray:
    return known.motion.states[:, 3] + known.motion.states[:, 0]


def around(effect: Effect, q: FloatArray, level: int) -> list[FloatArray]:
    """Points between a grid point and its neighbours, finer at each level."""
    points = []
    for i, p in enumerate(effect.parameters):
        if p.role != "shape" or len(p.grid) == 1:
            continue
        for share in (-0.5, -0.25, 0.25, 0.5):
            moved = q.copy()
            moved[i] = _between(p, q[i], share * 0.4**level)
            points.append(moved)
    unit = []
    for point in points:
        # Amplitudes are scored from their usual size.
        for i, p in enumerate(effect.parameters):
            if p.role != "shape":
                point[i] = p.grid[0]
        unit.append(point)
    return unit


def _between(p: EffectParameter, value: float, share: float) -> float:
    if p.name in ("time", "order"):
        # A peak over the angle is as narrow as the recordings' turns are many.
        spread = 2.0 if p.name == "time" else 0.05
        return max(value + share * spread, p.low)
    if p.name == "frequency" and len(p.grid) > 12:
        return value + share * 0.02
    grid = np.array(p.grid)
    ratio = float(grid[-1] / grid[0]) ** (1.0 / max(len(grid) - 1, 1))
    return min(max(value * ratio**share, max(p.low, 1e-9)), p.high)
