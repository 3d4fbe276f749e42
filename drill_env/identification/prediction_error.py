"""Prediction errors of a rig over recordings, their likelihood and its derivatives."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray, IntArray
from drill_env.friction import kernel_record
from drill_env.identification._filter import FILTER, N_FILTER, run_filter
from drill_env.identification.initial_state import state_at
from drill_env.identification.noise import NoiseModel, repeated_counts
from drill_env.integrator._advance import DONE
from drill_env.integrator._records import EVENT, RUN, STEPS_PER_PERIOD, new_work
from drill_env.integrator._tableau import TABLEAUX
from drill_env.parameters import SYMBOLS, Rig
from drill_env.recordings import Recording

_RTOL = 1e-7
# Doubt about the velocities that a restart takes from the samples around it.
_START_SPEED = 0.3
_START_ANGLE = 0.05


class Buffers(NamedTuple):
    """Working arrays of one compiled filter run."""

    breaks: FloatArray
    piece: FloatArray
    t_eval: FloatArray
    out: FloatArray
    modes: IntArray
    log: np.ndarray
    sens: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """One recording as the filter reads it.

    Attributes:
        recording: where it came from.
        t: times from 0, s, shape (n,).
        u: held voltages, V, shape (n,).
        angles: theta_u and theta_l, rad, NaN where missing, shape (n, 2).
        repeats: samples that share one rounding error, shape (n, 2).
        restarts: rows where the state is unknown, shape (m,).
        starts: filter states there, shape (m, 7).
        spreads: their standard deviations, shape (m, 7).
    """

    recording: Recording
    t: FloatArray
    u: FloatArray
    angles: FloatArray
    repeats: FloatArray
    restarts: IntArray
    starts: FloatArray
    spreads: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Score:
    """Sums over recordings.

    Attributes:
        value: minus twice the log likelihood of the angles, without its constant.
        gradient: derivative of half of the log likelihood's double by the parameters with the
            filter's gains held, shape (14,).
        information: expected curvature, shape (14, 14).
        samples: number of angles that were predicted.
    """

    value: float
    gradient: FloatArray
    information: FloatArray
    samples: int


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """What the filter knew at each row.

    Attributes:
        innovation: measured minus predicted angle of (theta_u, theta_l), rad, shape (n, 2).
        variance: variance the filter gave it, rad^2, shape (n, 2); 0 where no sample is.
        state: twist, omega_u, omega_l, theta_l, d_u, d_l, twist offset; shape (n, 7).
    """

    innovation: FloatArray
    variance: FloatArray
    state: FloatArray

    @property
    def standardised(self) -> FloatArray:
        """Innovations over their standard deviations, shape (n, 2); NaN where no sample is."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(self.variance > 0, self.innovation / np.sqrt(self.variance), np.nan)


def prepare(
    recording: Recording, rig: Rig, *, window: float = math.inf, offset: float = 0.1
) -> Samples:
    """Make a recording ready for the filter.

    Args:
        recording: with u and theta_u or theta_l.
        rig: tells a one-inertia rig from a whole one.
        window: s after which the state is forgotten and estimated anew (multiple shooting).
        offset: standard deviation of the twist that the encoders do not show at their zeros,
            rad.

    Raises:
        InputError: a channel is missing or an argument is out of range.
    """
    if not window > 0:
        raise InputError(f"window is {window}: give seconds greater than 0")
    t = recording.t - recording.t[0]
    u = recording.channel("u")
    angles = np.full((len(t), 2), math.nan)
    repeats = np.ones((len(t), 2))
    if not recording.angles():
        recording.channel("theta_u")
    for place, name in enumerate(("theta_u", "theta_l")):
        if rig.inertias == 1 and name == "theta_l":
            continue
        theta = recording.channels().get(name)
        if theta is not None:
            angles[:, place] = theta
            if name in recording.quanta:
                repeats[:, place] = repeated_counts(theta)
    restarts = _restarts(t, recording.interval, window)
    starts = np.zeros((len(restarts), N_FILTER))
    spreads = np.zeros((len(restarts), N_FILTER))
    for i, row in enumerate(restarts.tolist()):
        starts[i, :4] = state_at(recording, rig, row)
        still = row == 0 and starts[i, 1] == 0.0 and starts[i, 2] == 0.0
        spreads[i, :4] = (_START_ANGLE, *([0.0 if still else _START_SPEED] * 2), _START_ANGLE)
        spreads[i, 6] = offset if rig.inertias == 2 else 0.0
    return Samples(recording, t, u, angles, repeats, restarts, starts, spreads)


def _restarts(t: FloatArray, interval: float, window: float) -> IntArray:
    # Across a gap the voltage is not known.
    rows = [0, *(np.flatnonzero(np.diff(t) > 1.6 * interval) + 1).tolist()]
    if math.isfinite(window):
        rows += np.searchsorted(t, np.arange(window, t[-1], window) - 1e-9).tolist()
    return np.unique(np.array(rows, dtype=np.int64))


def _filter(
    samples: Samples, rig: Rig, noise: NoiseModel, sensitivities: bool, robust: float, rows: int
) -> tuple[np.ndarray, FloatArray]:
    f = np.zeros(1, dtype=FILTER)
    f["variance"] = (noise.torque_u**2, noise.torque_l**2)
    f["rate"] = (1.0 / noise.tau_u, 1.0 / noise.tau_l)
    f["robust"], f["parameters"] = robust, len(SYMBOLS) if sensitivities else 0
    run = np.zeros(1, dtype=RUN)
    run["h"] = samples.t[1]
    work = new_work(
        _RTOL, 0.1 * _RTOL, rig.natural_period / STEPS_PER_PERIOD, sensitivity=True, event_tol=1e-12
    )
    buffers = Buffers(
        np.zeros(2), np.zeros((1, 1)), np.zeros(0), np.zeros((0, 4)),
        np.zeros((0, 2), dtype=np.int64), np.zeros(256, dtype=EVENT), np.zeros((0, 4, 1)),
    )  # fmt: skip
    trace = np.zeros((rows, 4 + N_FILTER))
    variance = samples.repeats * np.array([noise.encoder_u, noise.encoder_l]) ** 2
    status = run_filter(
        f[0], kernel_record(rig)[0], run[0], work[0], TABLEAUX["dopri5"][0], samples.t, samples.u,
        samples.angles, variance, samples.restarts, samples.starts, samples.spreads, buffers,
        trace,
    )  # fmt: skip
    if status != DONE:
        f["value"] = math.inf
    return f, trace


def score(
    recordings: Sequence[Samples],
    rig: Rig,
    noise: Sequence[NoiseModel],
    *,
    sensitivities: bool = True,
    robust: float = math.inf,
) -> Score:
    """Likelihood of recordings under a rig and a noise model each, and its derivatives.

    Args:
        recordings: from `prepare`.
        rig: parameters.
        noise: one model a recording.
        sensitivities: whether the derivatives are wanted; else they are 0.
        robust: standard deviations beyond which an innovation loses weight (Huber).
    """

    def one(i: int) -> np.ndarray:
        return _filter(recordings[i], rig, noise[i], sensitivities, robust, 0)[0][0]

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        parts = list(pool.map(one, range(len(recordings))))
    lower = sum(part["information"] for part in parts)
    information = np.tril(lower) + np.tril(lower, -1).T
    return Score(
        sum(float(part["value"]) for part in parts),
        np.sum([part["gradient"] for part in parts], axis=0),
        information,
        sum(int(part["count"]) for part in parts),
    )


def trace_of(samples: Samples, rig: Rig, noise: NoiseModel) -> Trace:
    """Innovations and filtered states of one recording."""
    _, rows = _filter(samples, rig, noise, False, math.inf, len(samples.t))
    return Trace(rows[:, 0:4:2], rows[:, 1:4:2], rows[:, 4:])
