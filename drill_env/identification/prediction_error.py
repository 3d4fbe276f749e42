"""Prediction errors of a rig over recordings, their likelihood and its derivatives."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from drill_env._types import BoolArray, FloatArray, IntArray
from drill_env.effects.along import joined, over_interval
from drill_env.effects.declared import Declared
from drill_env.effects.signal import MOST_STATES, PORTS, SIGNAL
from drill_env.friction import kernel_record
from drill_env.identification._filter import run_filter
from drill_env.identification._filter_effects import Acting
from drill_env.identification._filter_state import (
    FILTER,
    N_FILTER,
    N_SLOPES,
    PATH,
    PATH_WITH_VELOCITIES,
)
from drill_env.identification.coordinates import solved
from drill_env.identification.known_loads import known_physics, with_added_inertia
from drill_env.identification.noise import SENSORS, NoiseModel
from drill_env.identification.samples import Samples
from drill_env.integrator.advance import DONE
from drill_env.integrator.records import EVENT, FIRST_PARAMETER, RUN, STEPS_PER_PERIOD, new_work
from drill_env.integrator.tableau import tableau
from drill_env.parameters import SYMBOLS, Rig

# Angle of the string's oscillation in a sample interval below which a pair of low order is
# exact enough, and cheaper; relative tolerances of either.
_SHORT = 0.05
_PAIRS = (("bs23", 1e-6), ("dopri5", 1e-7))
# A sample interval needs a few steps; a rig far from sense would take them for ever.
_MOST_STEPS = 2000


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
class Score:
    """The likelihood of one recording and its derivatives by the parameters and the starts.

    Attributes:
        value: minus twice the log likelihood of readings and starts, without its constant.
        gradient: descent of half of the value with the filter's gains held, the starts
            eliminated, shape (14,).
        information: expected curvature likewise, shape (14, 14).
        start_step: Gauss-Newton step of the starts while the parameters stay, shape (m, 5).
        start_slope: what it loses for each unit that a parameter moves, shape (m, 5, 14).
        samples: number of readings that were predicted.
    """

    value: float
    gradient: FloatArray
    information: FloatArray
    start_step: FloatArray
    start_slope: FloatArray
    samples: int


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """What the filter knew at each row.

    Attributes:
        innovation: measured minus predicted reading, in the order and shape of `Samples.angles`.
        variance: variance the filter gave it; 0 where no sample is.
        state: twist, omega_u, omega_l, theta_l, d_u, d_l; shape (n, 6).
        transitions: of the state into each row, in single precision, shape (n, 4, 6); no rows
            where the pass kept none.
        stuck: which discs rest at each row, shape (n, 2), likewise.
    """

    innovation: FloatArray
    variance: FloatArray
    state: FloatArray
    transitions: np.ndarray
    stuck: np.ndarray

    @property
    def standardised(self) -> FloatArray:
        """Innovations over their standard deviations; NaN where no sample is."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(self.variance > 0, self.innovation / np.sqrt(self.variance), np.nan)


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """One pass of the filter, row by row.

    Attributes:
        value: minus twice the log likelihood of the readings, without constant and starts.
        trace: innovations and filtered states.
        rows: records of `path_type`, shape (n,).
        slopes: of the predicted readings by the parameters and the start, over their standard
            deviations, shape (n, readings, 19); no rows where none were wanted.
    """

    value: float
    trace: Trace
    rows: np.ndarray
    slopes: FloatArray


class _Run(NamedTuple):
    """What one pass of the filter left."""

    f: np.ndarray
    gradients: FloatArray
    informations: FloatArray
    trace: FloatArray
    path: np.ndarray
    slopes: FloatArray


def _acting(effects: Declared) -> Acting:
    upper = effects.entries["upper"] != 0
    discs = np.array([upper.any(), not upper.all()], dtype=np.int64)
    memory = np.zeros(effects.inner + effects.switches + 1)
    return Acting(
        effects.entries, discs, memory, memory.copy(), memory.copy(), np.zeros(1, dtype=SIGNAL),
        np.zeros(1, dtype=PORTS), np.zeros((2, 4)), np.zeros(2), np.zeros((5, MOST_STATES)),
        over_interval.address if len(effects.entries) else 0,
        bool(effects.entries["only_at_rest"].all()),
    )  # fmt: skip


def _pair(samples: Samples, rig: Rig) -> tuple[np.ndarray, float]:
    """The integrator's coefficients for a recording, and its relative tolerance."""
    interval = float(samples.t[-1]) / (len(samples.t) - 1)
    name, rtol = _PAIRS[0 if 2.0 * math.pi * interval < _SHORT * rig.natural_period else 1]
    return tableau(name, sensitivity=True), rtol


def _filter(
    samples: Samples,
    rig: Rig,
    noise: NoiseModel,
    starts: FloatArray,
    *,
    slopes: bool,
    robust: float = math.inf,
    rows: int = 0,
    path_rows: int = 0,
) -> _Run:
    rig = with_added_inertia(rig, samples.recording)
    f = np.zeros(1, dtype=FILTER)
    f["variance"] = (noise.torque_u**2, noise.torque_l**2)
    f["rate"] = (1.0 / noise.tau_u, 1.0 / noise.tau_l)
    f["robust"], f["slopes"] = robust, N_SLOPES if slopes else 0
    f["relative"] = samples.relative
    f["release"], f["parts"], f["summed"] = samples.release, 1, path_rows == 0
    run = np.zeros(1, dtype=RUN)
    run["h"] = samples.t[1]
    tableau, rtol = _pair(samples, rig)
    longest = rig.natural_period / STEPS_PER_PERIOD
    work = new_work(rtol, 0.1 * rtol, longest, sensitivity=True, event_tol=1e-12)
    work["max_steps"] = _MOST_STEPS
    if not slopes:
        work["columns"] = FIRST_PARAMETER
    buffers = Buffers(
        np.zeros(2), np.zeros((1, 1)), np.zeros(0), np.zeros((0, 4)),
        np.zeros((0, 2), dtype=np.int64), np.zeros(256, dtype=EVENT), np.zeros((0, 4, 1)),
    )  # fmt: skip
    known = known_physics(rig, samples.recording)
    acting = _acting(joined(known, samples.acting))
    windows, readings = len(samples.restarts), samples.angles.shape[1]
    left = _Run(
        f, np.zeros((windows, N_SLOPES)), np.zeros((windows, N_SLOPES, N_SLOPES)),
        np.zeros((rows, 2 * readings + N_FILTER)),
        np.zeros(path_rows, dtype=PATH if readings == 2 else PATH_WITH_VELOCITIES),
        np.zeros((path_rows if slopes else 0, readings, N_SLOPES)),
    )  # fmt: skip
    variance = reading_variances(samples, noise)
    status = run_filter(
        f[0], kernel_record(rig)[0], run[0], work[0], tableau[0], samples.t, samples.u,
        samples.loads, acting, samples.angles, variance, samples.restarts, starts, buffers,
        left.gradients, left.informations, left.trace, left.path, left.slopes,
    )  # fmt: skip
    if status != DONE:
        f["value"] = math.inf
    return left


def score(
    samples: Samples, rig: Rig, noise: NoiseModel, starts: FloatArray, robust: float = math.inf
) -> Score:
    """Likelihood of a recording under a rig, a noise model and starts, and its derivatives.

    Args:
        samples: from `prepare`.
        rig: parameters.
        noise: of this recording.
        starts: as `Samples.starts`, shape (m, 5).
        robust: standard deviations beyond which an innovation loses weight (Huber).
    """
    left = _filter(samples, rig, noise, starts, slopes=True, robust=robust)
    n = len(SYMBOLS)
    gradient, information = np.zeros(n), np.zeros((n, n))
    steps, slopes = np.zeros_like(starts), np.zeros((*starts.shape, n))
    known = samples.spreads <= 0.0
    weights = 1.0 / np.where(known, 1.0, samples.spreads) ** 2
    miss = np.where(known, 0.0, samples.starts - starts)
    for i, lower in enumerate(left.informations):
        whole = np.tril(lower) + np.tril(lower, -1).T
        free = np.flatnonzero(~known[i])
        inner = whole[np.ix_(n + free, n + free)] + np.diag(weights[i, free])
        cross = solved(inner, whole[n + free, :n])
        pull = left.gradients[i, n + free] + (weights[i] * miss[i])[free]
        steps[i, free] = solved(inner, pull)
        slopes[i, free] = cross
        gradient += left.gradients[i, :n] - cross.T @ pull
        information += whole[:n, :n] - whole[:n, n + free] @ cross
    value = float(left.f["value"][0]) + float(np.sum(weights * miss**2))
    return Score(value, gradient, information, steps, slopes, int(left.f["count"][0]))


def trace_of(
    samples: Samples,
    rig: Rig,
    noise: NoiseModel,
    starts: FloatArray | None = None,
    robust: float = math.inf,
) -> Trace:
    """Innovations and filtered states of one recording, from its first guess by default."""
    starts = samples.starts if starts is None else starts
    rows = _filter(
        samples, rig, noise, starts, slopes=False, robust=robust, rows=len(samples.t)
    ).trace
    return _trace(rows, np.zeros(0, dtype=PATH))


def _trace(rows: FloatArray, path: np.ndarray) -> Trace:
    ends = rows.shape[1] - N_FILTER
    # Traces are kept by the dozen: they hold what they need and nothing twice as fine.
    return Trace(
        rows[:, 0:ends:2], rows[:, 1:ends:2], rows[:, ends:],
        path["F"].astype(np.float32), path["stuck"].astype(np.bool_),
    )  # fmt: skip


def flat(values: FloatArray, used: BoolArray) -> FloatArray:
    """Values of the used readings, one after another; a choice would copy them row by row."""
    return values.reshape(-1, *values.shape[2:]) if used.all() else values[used]


def reading_variances(samples: Samples, noise: NoiseModel) -> FloatArray:
    """Variances of the samples under a noise model, rad^2 or rad^2/s^2, shape (n, readings)."""
    sizes = np.array([getattr(noise, name) for name in SENSORS[: samples.angles.shape[1]]])
    return samples.repeats * sizes**2


def value_of(
    samples: Samples, rig: Rig, noise: NoiseModel, starts: FloatArray, robust: float = math.inf
) -> float:
    """Minus twice the log likelihood of the readings, without its constant and the starts."""
    left = _filter(samples, rig, noise, starts, slopes=False, robust=robust)
    return float(left.f["value"][0])


def path_of(
    samples: Samples,
    rig: Rig,
    noise: NoiseModel,
    starts: FloatArray,
    robust: float = math.inf,
    *,
    slopes: bool = False,
) -> Path:
    """As `trace_of`, with records of `path_type` that carry other errors through the same filter.

    Args:
        samples: from `prepare`.
        rig: parameters.
        noise: of this recording.
        starts: as `Samples.starts`, shape (m, 5).
        robust: standard deviations beyond which an innovation loses weight (Huber).
        slopes: whether the derivatives by the parameters and the starts are wanted.
    """
    rows = len(samples.t)
    left = _filter(
        samples, rig, noise, starts, slopes=slopes, robust=robust, rows=rows, path_rows=rows
    )
    trace = _trace(left.trace, left.path)
    return Path(float(left.f["value"][0]), trace, left.path, left.slopes)
