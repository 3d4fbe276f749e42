"""Recordings of a rig with something concealed: played, disturbed, counted."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from benchmarks.concealed.fields import RIG, plant_record, substeps_for
from benchmarks.concealed.other_laws import CONCEALABLE
from benchmarks.concealed.plant import Played, play, predict_again
from benchmarks.concealed.sensors import Sensors, losses, recorded, sample_times, shown
from benchmarks.concealed.signals import FASTEST, RATE
from benchmarks.rig_maker import coloured

Array = NDArray[np.float64]
JITTER = 1e-5
TORQUE_NOISE, NOISE_TAU = (0.02, 2e-4), 0.1


@dataclass(frozen=True)
class Hidden:
    """One effect at one size: its id and its parameters in SI units."""

    id: str
    parameters: Mapping[str, float]


@dataclass(frozen=True)
class Truth:
    """Everything that lies behind the recordings of a case.

    Attributes:
        rig: the fourteen parameters.
        hidden: effects in it, the small unlisted one too.
        torque: standard deviations of the coloured torques on the discs, Nm.
        counts: of the encoders, a turn.
        bursts: times that rows are lost in each recording.
        jitter: standard deviation of the sampling instants, s.
        pretwist: most that the string is twisted at the start, of what the brake can hold.
    """

    rig: Mapping[str, float]
    hidden: tuple[Hidden, ...] = ()
    torque: tuple[float, float] = TORQUE_NOISE
    counts: int = 8192
    bursts: int = 0
    jitter: float = JITTER
    pretwist: float = 0.4

    def parts(self) -> tuple[np.ndarray, Sensors]:
        """The plant and its sensors."""
        plant: dict[str, float] = {}
        sensors: dict[str, float] = {}
        for hidden in self.hidden:
            of_plant, of_sensors = CONCEALABLE[hidden.id].settings(hidden.parameters)
            plant.update(of_plant)
            sensors.update(of_sensors)
        return plant_record(dict(self.rig), plant), Sensors(counts=self.counts, **sensors)


@dataclass(frozen=True)
class Made:
    """One recording as it is written, and what only its maker knows.

    Attributes:
        t: nominal times, s, lost rows left out, shape (n,).
        u: V, shape (n,).
        angles: theta_u and theta_l, rad, shape (n, 2).
        oracle: rms error of 5 s predictions by the true plant from true states without the
            noise, rad, by channel.
    """

    t: Array
    u: Array
    angles: Array
    oracle: Mapping[str, float] = field(default_factory=dict)


def draw_rig(
    rng: np.random.Generator, paper: Mapping[str, float], spread: float
) -> dict[str, float]:
    """Parameters within `spread` of the paper's whose brake never drives the disc."""
    speeds = np.linspace(0.0, 0.85 * FASTEST, 60)
    for _ in range(1000):
        rig = {name: float(paper[name] * rng.uniform(1 - spread, 1 + spread)) for name in RIG}
        if _brake(rig, speeds).min() > 0.0:
            return rig
    raise RuntimeError(f"no rig within {spread:.0%} of the paper's has a brake that only brakes")


def _brake(rig: Mapping[str, float], v: Array) -> Array:
    first = rig["T1"] * np.tanh(0.5 * rig["beta1"] * v)
    return rig["Tsl"] + first + rig["T2"] * np.tanh(0.5 * rig["beta2"] * v) + rig["bl"] * v


def make_recording(truth: Truth, u: Array, seed: tuple[int, ...], *, oracle: bool = False) -> Made:
    """Play voltages to the true rig and read its encoders; one seed, one recording."""
    rng = np.random.default_rng(seed)
    record, sensors = truth.parts()
    times = sample_times(rng, len(u), RATE, truth.jitter, sensors)
    substeps = substeps_for(record, 1.0 / RATE)
    n = len(u) * substeps
    # Coloured far slower than a substep, so that one series serves plants of any substep.
    grid = [coloured(rng, 10 * len(u), 0.1 / RATE, torque, NOISE_TAU) for torque in truth.torque]
    places = np.arange(n) * 10 // substeps
    most = truth.pretwist * truth.rig["Tsl"] / truth.rig["ktheta"]
    twist = rng.uniform(-most, most)
    played = play(record, u, times, (grid[0][places], grid[1][places]), twist=twist,
                  substeps=substeps)  # fmt: skip
    lost = losses(rng, played.states, sensors)
    # The encoders are zeroed where the discs stood.
    zero = np.array([twist, 0.0])
    angles = recorded(rng, shown(times, played.states, sensors) - lost - zero, sensors)
    found: dict[str, float] = {}
    if oracle:
        found = _oracle(record, sensors, u, played, substeps, angles + lost + zero)
    rows = _kept_rows(rng, len(u), truth.bursts)
    return Made(np.arange(len(u))[rows] / RATE, u[rows], angles[rows], found)


def _kept_rows(rng: np.random.Generator, n: int, bursts: int) -> NDArray[np.int64]:
    keep = np.ones(n, dtype=bool)
    for _ in range(bursts):
        start = int(rng.integers(n // 10, n - n // 10))
        keep[start : start + int(rng.integers(2, 40))] = False
    return np.flatnonzero(keep)


def _oracle(
    record: np.ndarray, sensors: Sensors, u: Array, played: Played, substeps: int, angles: Array
) -> dict[str, float]:
    states = predict_again(record, u, played, substeps)
    gap = angles.copy()
    # Delayed encoders look back within each window.
    for first in range(0, len(u), played.every):
        part = slice(first, first + played.every)
        gap[part] -= shown(played.times[part], states[part], sensors)
    names = ("theta_u", "theta_l")
    return {n: math.sqrt(float(np.mean(g**2))) for n, g in zip(names, gap.T, strict=True)}
