"""Compiled step and start of any number of environments, one per row."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drill_env._jit import kernel
from drill_env._types import FloatArray, IntArray
from drill_env.dynamics._kernels import lower_rate, upper_rate
from drill_env.environment._layout import (
    DELAY,
    FRICTION_FACTOR,
    FRICTION_STEP,
    HEAD,
    LOST_L,
    LOST_U,
    MEASURED_L,
    MEASURED_U,
    MEMORY_L,
    MEMORY_U,
    MODE_CLAMP,
    NOISE_ROW,
    OMEGA_L,
    OMEGA_U,
    SETPOINT,
    SPEED_L,
    SPEED_U,
    STEP,
    STEP_SIZE,
    THETA_L,
    TWIST,
    VOLTAGE,
)
from drill_env.integrator._advance import (
    DONE,
    LOG_FULL,
    Log,
    Options,
    Scratch,
    advance,
    new_log,
    new_scratch,
)
from drill_env.integrator._events import MAXIMUM, start_mode
from drill_env.integrator._variational import N_COLUMNS, N_STATE
from drill_env.parameters._vector import BL, JL, JU, KM, KTHETA, T1, T2, TSL
from drill_env.sensors._kernels import filter_sample, quantise, start_filter


VIEW_BOTH, VIEW_SURFACE, VIEW_STATE = 0, 1, 2


class Arrays(NamedTuple):
    """State of all environments, one row each."""

    p: FloatArray
    floats: FloatArray
    ints: IntArray
    history: FloatArray
    schedule_steps: IntArray
    schedule_values: FloatArray
    noise: FloatArray
    reward: FloatArray
    info: FloatArray
    observation: NDArray[np.float32]


class Setting(NamedTuple):
    """What all environments share."""

    period: float
    samples: int
    quantum: float
    noise_rad: float
    missed: float
    rate: float
    b: FloatArray
    a: FloatArray
    limit: float
    weights: FloatArray
    rtol: float
    shown: int
    bounds: FloatArray


class Work(NamedTuple):
    """Working arrays of the compiled functions."""

    scratch: Scratch
    log: Log
    breaks: FloatArray
    piece: FloatArray
    times: FloatArray
    out: FloatArray
    modes: IntArray
    sens: FloatArray
    sens_out: FloatArray
    stats: IntArray
    clock: FloatArray
    now: FloatArray
    mode: IntArray


def new_work(samples: int, period: float) -> Work:
    """Working arrays for `samples` encoder samples per control period (s)."""
    times = period * np.arange(1, samples + 1) / samples
    times[-1] = period
    return Work(
        new_scratch(), new_log(64), np.zeros(2), np.zeros((1, 1)), times,
        np.zeros((samples, N_STATE)), np.zeros((samples, 2), dtype=np.int64),
        np.zeros((N_STATE, N_COLUMNS)), np.zeros((0, N_STATE, N_COLUMNS)),
        np.zeros(5, dtype=np.int64), np.zeros(3), np.zeros(4), np.zeros(3, dtype=np.int64),
    )  # fmt: skip


@kernel
def lose_counts(previous, now, quantum, chance, uniform):
    """Angle (rad) lost for good between two samples."""
    moved = abs(now - previous) / quantum
    lost = floor_share(moved * chance, uniform)
    return lost * quantum if now > previous else -lost * quantum


@kernel
def floor_share(mean, uniform):
    """Whole number with the given mean: the next one up with the chance of the remainder."""
    whole = np.floor(mean)
    return whole + (1.0 if uniform < mean - whole else 0.0)


@kernel
def read_sensors(i, j, theta_u, theta_l, arrays, setting):
    """Pass one encoder sample of environment `i` through delay, counts and filter."""
    f, n = arrays.floats[i], arrays.ints[i]
    ring = arrays.history[i]
    length = ring.shape[0]
    head = n[HEAD] + 1 if n[HEAD] + 1 < length else 0
    n[HEAD] = head
    ring[head, 0], ring[head, 1] = theta_u, theta_l
    late = head - n[DELAY]
    if late < 0:
        late += length
    seen_u, seen_l = ring[late, 0], ring[late, 1]
    if arrays.noise.shape[1] > 0:
        draw = arrays.noise[i, n[NOISE_ROW], j]
        if setting.missed > 0.0 and setting.quantum > 0.0:
            f[LOST_U] += lose_counts(
                f[MEMORY_U] + f[LOST_U], seen_u, setting.quantum, setting.missed, draw[2]
            )
            f[LOST_L] += lose_counts(
                f[MEMORY_L] + f[LOST_L], seen_l, setting.quantum, setting.missed, draw[3]
            )
        seen_u += setting.noise_rad * draw[0] - f[LOST_U]
        seen_l += setting.noise_rad * draw[1] - f[LOST_L]
    f[MEASURED_U] = quantise(seen_u, setting.quantum)
    f[MEASURED_L] = quantise(seen_l, setting.quantum)
    memory_u, memory_l = f[MEMORY_U : MEMORY_U + 3], f[MEMORY_L : MEMORY_L + 3]
    f[SPEED_U] = filter_sample(memory_u, f[MEASURED_U], setting.rate, setting.b, setting.a)
    f[SPEED_L] = filter_sample(memory_l, f[MEASURED_L], setting.rate, setting.b, setting.a)


@kernel
def start_sensors(i, arrays, setting):
    """Encoders and filters of environment `i` as if it had turned steadily before."""
    f, n = arrays.floats[i], arrays.ints[i]
    ring = arrays.history[i]
    length = ring.shape[0]
    n[HEAD] = length - 1
    for k in range(length):
        age = (length - 1 - k) / setting.rate
        ring[k, 0] = f[TWIST] + f[THETA_L] - age * f[OMEGA_U]
        ring[k, 1] = f[THETA_L] - age * f[OMEGA_L]
    late = length - 1 - n[DELAY]
    f[LOST_U] = f[LOST_L] = 0.0
    f[MEASURED_U] = quantise(ring[late, 0], setting.quantum)
    f[MEASURED_L] = quantise(ring[late, 1], setting.quantum)
    f[SPEED_U], f[SPEED_L] = f[OMEGA_U], f[OMEGA_L]
    memory_u, memory_l = f[MEMORY_U : MEMORY_U + 3], f[MEMORY_L : MEMORY_L + 3]
    start_filter(memory_u, f[MEASURED_U], f[OMEGA_U], setting.b, setting.a)
    start_filter(memory_l, f[MEASURED_L], f[OMEGA_L], setting.b, setting.a)


@kernel
def follow_schedule(i, arrays):
    """Set point and friction step that take effect at the present step."""
    f, n, p = arrays.floats[i], arrays.ints[i], arrays.p[i]
    steps = arrays.schedule_steps[i]
    for k in range(steps.size):
        if steps[k] == n[STEP]:
            f[SETPOINT] = arrays.schedule_values[i, k]
    if n[STEP] == n[FRICTION_STEP]:
        for k in (TSL, T1, T2, BL):
            p[k] *= f[FRICTION_FACTOR]


@kernel
def fill_reward(i, old_voltage, arrays, setting):
    """Reward of environment `i` and its parts, from the true state."""
    f, info = arrays.floats[i], arrays.info[i]
    target, w = f[SETPOINT], setting.weights
    error = abs(f[OMEGA_L] - target) / target
    info[11] = w[0] / (1.0 + (error / w[5]) ** 2)
    info[12] = -w[1] * min(error, 2.0)
    info[13] = -w[2] * min(abs(f[OMEGA_U] - f[OMEGA_L]) / target, 2.0)
    info[14] = -w[3] if abs(f[OMEGA_L]) < w[6] else 0.0
    info[15] = -w[4] * ((f[VOLTAGE] - old_voltage) / setting.limit) ** 2
    arrays.reward[i] = info[11] + info[12] + info[13] + info[14] + info[15]


@kernel
def fill_truth(i, arrays):
    """What `info` tells of environment `i` and its sensors do not."""
    f, n, p, info = arrays.floats[i], arrays.ints[i], arrays.p[i], arrays.info[i]
    rate_u = upper_rate(p, n[0], f[TWIST], f[OMEGA_U], f[VOLTAGE])
    rate_l = lower_rate(p, n[1], n[MODE_CLAMP], f[TWIST], f[OMEGA_L])
    info[0], info[1], info[2] = f[TWIST], f[OMEGA_U], f[OMEGA_L]
    info[3], info[4] = f[TWIST] + f[THETA_L], f[THETA_L]
    info[5] = p[KM] * f[VOLTAGE] - p[KTHETA] * f[TWIST] - p[JU] * rate_u
    info[6] = p[KTHETA] * f[TWIST] - p[JL] * rate_l
    info[7] = 1.0 if n[0] == 0 else 0.0
    info[8] = 1.0 if n[1] == 0 else 0.0
    info[9], info[10] = f[SETPOINT], f[VOLTAGE]


@kernel
def measured(i, arrays, view, out):
    """What the sensors of view `view` show of environment `i`; returns how many numbers."""
    f = arrays.floats[i]
    if view == VIEW_SURFACE:
        out[0] = f[SPEED_U]
        return 1
    if view == VIEW_STATE:
        out[0], out[1], out[2] = f[TWIST], f[OMEGA_U], f[OMEGA_L]
    else:
        out[0], out[1], out[2] = f[MEASURED_U] - f[MEASURED_L], f[SPEED_U], f[SPEED_L]
    return 3


@kernel
def fill_observation(i, fresh, arrays, setting, work):
    """Observation: present measurements, set point, voltage, then past frames, newest first."""
    f, row = arrays.floats[i], arrays.observation[i]
    now = work.now
    n = measured(i, arrays, setting.shown, now)
    frame = n + 1
    past = (row.size - n - 2) // frame
    if not fresh:
        for k in range(past - 1, -1, -1):
            to = n + 2 + k * frame
            source = 0 if k == 0 else to - frame
            for j in range(n):
                row[to + j] = row[source + j]
            row[to + n] = row[n + 1] if k == 0 else row[source + n]
    now[n] = f[VOLTAGE]
    for j in range(n):
        row[j] = min(max(now[j], -setting.bounds[j]), setting.bounds[j])
    row[n] = f[SETPOINT]
    row[n + 1] = f[VOLTAGE]
    if fresh:
        for k in range(past):
            for j in range(n):
                row[n + 2 + k * frame + j] = row[j]
            row[n + 2 + k * frame + n] = row[n + 1]


@kernel
def run_constant(p, y, mode, volts, seconds, step, times, tableau, rtol, extrema, work):
    """Carry a state on under a constant voltage (V); returns the status of `advance`.

    States at `times` are left in `work.out`, the step to go on with in `work.clock[1]`.
    """
    options = Options(rtol, 0.1 * rtol, 0.3, 1_000_000_000, extrema, False)
    stats, clock = work.stats, work.clock
    work.breaks[1] = seconds
    work.piece[0, 0] = volts
    clock[0], clock[1] = 0.0, step
    stats[0] = stats[3] = stats[4] = 0
    status = LOG_FULL
    while status == LOG_FULL:
        work.log.count[0] = 0
        status = advance(
            p, y, mode, clock, work.breaks, work.piece, times, work.out, work.modes, work.log,
            work.sens, work.sens_out, stats, tableau, options, work.scratch,
        )  # fmt: skip
    return status


@kernel
def step_rows(first, last, skip, volts, arrays, setting, tableau, work):
    """One control period for the environments first..last-1 that are not skipped.

    Returns:
        The first environment whose integration failed, or -1.
    """
    for i in range(first, last):
        if skip[i]:
            continue
        f, n = arrays.floats[i], arrays.ints[i]
        old = f[VOLTAGE]
        f[VOLTAGE] = min(max(volts[i], -setting.limit), setting.limit)
        follow_schedule(i, arrays)
        status = run_constant(
            arrays.p[i], f[:N_STATE], n[:3], f[VOLTAGE], setting.period, f[STEP_SIZE],
            work.times, tableau, setting.rtol, False, work,
        )  # fmt: skip
        if status != DONE:
            return i
        f[STEP_SIZE] = work.clock[1]
        for j in range(setting.samples):
            read_sensors(i, j, work.out[j, 0] + work.out[j, 3], work.out[j, 3], arrays, setting)
        n[STEP] += 1
        n[NOISE_ROW] += 1
        fill_reward(i, old, arrays, setting)
        fill_truth(i, arrays)
        fill_observation(i, False, arrays, setting, work)
    return -1


@kernel
def start_row(i, arrays, setting, work):
    """Modes, sensors, truth and observation of environment `i` in its initial state."""
    f, n = arrays.floats[i], arrays.ints[i]
    follow_schedule(i, arrays)
    start_mode(arrays.p[i], f[:N_STATE], n[:3], f[VOLTAGE])
    start_sensors(i, arrays, setting)
    fill_reward(i, f[VOLTAGE], arrays, setting)
    fill_truth(i, arrays)
    fill_observation(i, True, arrays, setting, work)


@kernel
def settle_on_cycle(p, y, volts, phase, settle, watch, tableau, work):
    """Put `y` on the open-loop limit cycle, `phase` of a period after a maximum of omega_l.

    Where the rig does not vibrate, `y` ends at its equilibrium. Returns whether the
    integration succeeded.
    """
    log, mode, none = work.log, work.mode, work.times[:0]
    for i in range(N_STATE):
        y[i] = 0.0
    start_mode(p, y, mode, volts)
    status = run_constant(p, y, mode, volts, settle, 1e-3, none, tableau, 1e-7, False, work)
    if status == DONE:
        status = run_constant(p, y, mode, volts, watch, 1e-3, none, tableau, 1e-7, True, work)
    last = before = -1
    for i in range(log.count[0]):
        if log.code[i, 1] == MAXIMUM:
            before, last = last, i
    if before >= 0 and status == DONE:
        period = log.t[last] - log.t[before]
        for i in range(N_STATE):
            y[i] = log.state[last, i]
        start_mode(p, y, mode, volts)
        if phase > 0.0:
            seconds = phase * period
            status = run_constant(
                p, y, mode, volts, seconds, 1e-3, none, tableau, 1e-7, False, work
            )
    y[THETA_L] = 0.0
    return status == DONE
