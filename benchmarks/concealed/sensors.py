"""Encoders and clock of the cases: what a true motion looks like in a recording."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Sensors:
    """What is wrong with the encoders and the clock; 0 where nothing is.

    Angles in rad, delays and clock in s; `coarse_*` is the step that is left when the lowest
    bits are lost, `missed_*` what each loss of counts takes.
    """

    counts: int = 8192
    eccentricity_u: float = 0.0
    eccentricity_phase_u: float = 0.0
    eccentricity_l: float = 0.0
    eccentricity_phase_l: float = 0.0
    second_order_l: float = 0.0
    gain_l: float = 0.0
    delay_u: float = 0.0
    delay_l: float = 0.0
    missed_u: float = 0.0
    missed_l: float = 0.0
    missed_rate: float = 0.05
    coarse_u: float = 0.0
    coarse_l: float = 0.0
    clock: float = 0.0
    repeated: float = 0.0
    repeated_run: float = 5.0


def sample_times(
    rng: np.random.Generator, n: int, rate: float, jitter: float, sensors: Sensors
) -> Array:
    """True instants of `n` samples and of the end of the last one, s, shape (n + 1,)."""
    sigma = math.hypot(jitter, sensors.clock)
    off = np.clip(rng.normal(0.0, 1.0, n + 1) * sigma, -0.4 / rate, 0.4 / rate)
    off[0] = 0.0
    return np.arange(n + 1) / rate + off


def _delayed(times: Array, angle: Array, speed: Array, delay: float) -> Array:
    """The angle `delay` s ago, by cubic Hermite pieces; before the start it moves evenly."""
    if delay == 0.0:
        return angle
    asked = times - delay
    i = np.clip(np.searchsorted(times, asked, side="right") - 1, 0, len(times) - 2)
    h = times[i + 1] - times[i]
    s = np.maximum(asked - times[i], 0.0) / h
    ends = (1 + 2 * s) * (1 - s) ** 2 * angle[i] + s**2 * (3 - 2 * s) * angle[i + 1]
    slopes = s * (1 - s) ** 2 * h * speed[i] + s**2 * (s - 1) * h * speed[i + 1]
    return ends + slopes + np.minimum(asked - times[0], 0.0) * speed[0]


def missed(rng: np.random.Generator, angle: Array, size: float, rate: float) -> Array:
    """Angle lost so far: `size` rad at a time, `rate` times for each rad travelled on average."""
    moves = np.diff(angle, prepend=angle[0])
    lost = rng.random(len(angle)) < rate * np.abs(moves)
    return np.cumsum(np.where(lost, size * np.sign(moves), 0.0))


def shown(times: Array, states: Array, sensors: Sensors) -> Array:
    """What errorless counting would show of a motion, with the encoders' own errors, (n, 2)."""
    turned = times[: len(states)]
    upper = _delayed(turned, states[:, 0], states[:, 1], sensors.delay_u)
    lower = _delayed(turned, states[:, 2], states[:, 3], sensors.delay_l)
    upper = upper + sensors.eccentricity_u * (
        np.sin(upper + sensors.eccentricity_phase_u) - math.sin(sensors.eccentricity_phase_u)
    )
    order_one = np.sin(lower + sensors.eccentricity_phase_l)
    start = math.sin(sensors.eccentricity_phase_l)
    lower = lower * (1.0 + sensors.gain_l) + sensors.eccentricity_l * (order_one - start)
    lower = lower + sensors.second_order_l * np.sin(2.0 * lower)
    return np.column_stack([upper, lower])


def losses(rng: np.random.Generator, states: Array, sensors: Sensors) -> Array:
    """Angles that missed counts have taken at each sample, shape (n, 2)."""
    found = np.zeros((len(states), 2))
    for place, size in enumerate((sensors.missed_u, sensors.missed_l)):
        if size > 0.0:
            found[:, place] = missed(rng, states[:, 2 * place], size, sensors.missed_rate)
    return found


def recorded(rng: np.random.Generator, angles: Array, sensors: Sensors) -> Array:
    """Angles as counted and handed over: rounded, bits lost, samples repeated, shape (n, 2)."""
    step = 2.0 * math.pi / sensors.counts
    found = np.floor(angles / step + 0.5) * step
    for place, coarse in enumerate((sensors.coarse_u, sensors.coarse_l)):
        bits = round(math.log2(max(coarse / step, 1.0)))
        if bits > 0:
            kept = step * 2**bits
            found[:, place] = np.floor(found[:, place] / kept + 1e-6) * kept
    if sensors.repeated > 0.0:
        run = int(sensors.repeated_run)
        stale = np.zeros(len(found), dtype=bool)
        for start in np.flatnonzero(rng.random(len(found)) < sensors.repeated / run):
            stale[max(start, 1) : start + run] = True
        source = np.maximum.accumulate(np.where(stale, 0, np.arange(len(found))))
        found = found[source]
    return found
