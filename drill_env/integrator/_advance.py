"""Compiled event-driven integration through a piecewise-polynomial voltage."""

from typing import NamedTuple

import numpy as np

from drill_env._jit import kernel
from drill_env._types import FloatArray, IntArray
from drill_env.dynamics._kernels import lower_rate, upper_rate
from drill_env.integrator._events import (
    CLAMP_DISC,
    LOWER,
    MAXIMUM,
    MINIMUM,
    UPPER,
    first_share,
    may_end,
    overdue,
    polish,
    transit,
)
from drill_env.integrator._step import (
    dense_at,
    error_norm,
    fill_dense,
    fill_rates,
    run_stages,
    voltage_at,
)
from drill_env.integrator._variational import N_COLUMNS, N_STATE, salt, step_sensitivity
from drill_env.parameters._vector import N_PARAMETERS

DONE, LOG_FULL, STEP_TOO_SMALL, TOO_MANY_STEPS = 0, 1, 2, 3
CHATTER_LIMIT = 12


class Scratch(NamedTuple):
    """Working arrays of one integration, reused between calls."""

    k: FloatArray
    ys: FloatArray
    dense: FloatArray
    ks: FloatArray
    work: FloatArray
    jac: FloatArray
    rates: FloatArray


class Log(NamedTuple):
    """Events: times, (disc, kind) and states; `count` holds the number written."""

    t: FloatArray
    code: IntArray
    state: FloatArray
    count: IntArray


class Options(NamedTuple):
    """Tolerances and limits of one integration."""

    rtol: float
    atol: float
    max_step: float
    max_steps: int
    extrema: bool
    sensitivity: bool


def new_scratch() -> Scratch:
    """Working arrays for any method."""
    return Scratch(
        np.zeros((16, N_STATE)),
        np.zeros((16, N_STATE)),
        np.zeros((N_STATE, 7)),
        np.zeros((16, N_STATE, N_COLUMNS)),
        np.zeros((N_STATE, N_COLUMNS)),
        np.zeros(4),
        np.zeros((2, N_PARAMETERS)),
    )


def new_log(capacity: int) -> Log:
    """Room for `capacity` events."""
    return Log(
        np.zeros(capacity),
        np.zeros((capacity, 2), dtype=np.int64),
        np.zeros((capacity, N_STATE)),
        np.zeros(1, dtype=np.int64),
    )


@kernel
def note(log, t, disc, kind, y):
    """Write one event down; False if the log is full."""
    n = log.count[0]
    if n >= log.t.size:
        return False
    log.t[n] = t
    log.code[n, 0] = disc
    log.code[n, 1] = kind
    for i in range(N_STATE):
        log.state[n, i] = y[i]
    log.count[0] = n + 1
    return True


@kernel
def change(which, p, t, y, mode, u, log, sens, options):
    """Pass disc `which` through its event: new mode, saltation, log entry."""
    before_u = upper_rate(p, mode[0], y[0], y[1], u)
    before_l = lower_rate(p, mode[1], mode[2], y[0], y[2])
    was_slipping = which != CLAMP_DISC and mode[which] != 0
    kind = transit(which, p, y, mode, u)
    if options.sensitivity and was_slipping:
        if which == UPPER:
            salt(sens, 1, before_u, upper_rate(p, mode[0], y[0], y[1], u))
        else:
            salt(sens, 2, before_l, lower_rate(p, mode[1], mode[2], y[0], y[2]))
    note(log, t, which, kind, y)


@kernel
def note_extremum(p, t, y, h, degree, scratch, last, log):
    """Log the turning point of omega_l inside the step, if there is one."""
    rate0, rate1 = scratch.k[0, 2], scratch.k[last, 2]
    if rate0 * rate1 >= 0.0:
        return
    a, b = 0.0, 1.0
    for _ in range(60):
        s = 0.5 * (a + b)
        slope = 0.0
        for m in range(degree - 1, -1, -1):
            slope = slope * s + (m + 1) * scratch.dense[2, m]
        if slope * rate0 > 0.0:
            a = s
        else:
            b = s
    turn = scratch.jac
    for i in range(N_STATE):
        turn[i] = dense_at(y, scratch.dense, degree, i, 0.5 * (a + b))
    note(log, t + 0.5 * (a + b) * h, LOWER, MAXIMUM if rate0 > 0.0 else MINIMUM, turn)


@kernel
def try_event(p, mode, y, piece, length, elapsed, h, tableau, scratch):
    """Earliest mode change inside the step just taken: (disc or -1, step length to it).

    The stages left in `scratch` are those of the step to the event.
    """
    last = tableau.stages
    degree = tableau.dense.shape[1]
    share, which, ready = 2.0, -1, False
    for disc in range(3):
        if may_end(disc, p, mode, scratch.ys, scratch.k, last, piece, length, elapsed, h):
            if not ready:
                run_stages(
                    p, mode, y, piece, length, elapsed, h, tableau, scratch.k, scratch.ys,
                    last + 1, last + tableau.extra,
                )  # fmt: skip
                fill_dense(h, tableau, scratch.k, 0, 3, scratch.dense)
                ready = True
            s = first_share(
                disc, p, mode, y, scratch.dense, degree, piece, length, elapsed, h
            )
            if s < share:
                share, which = s, disc
    if which < 0 or share == 0.0:
        return which, 0.0 if which >= 0 else h
    h = polish(
        which, p, mode, y, piece, length, elapsed, share * h, h, tableau, scratch.k, scratch.ys
    )
    return which, h


@kernel
def write_samples(t, end, y, h, next_sample, t_eval, out, modes, mode, dense, degree, y_end):
    """Fill the samples in (t, end]; returns the index of the next one."""
    while next_sample < t_eval.size and t_eval[next_sample] <= end:
        if t_eval[next_sample] == end:
            for i in range(N_STATE):
                out[next_sample, i] = y_end[i]
        else:
            s = (t_eval[next_sample] - t) / h
            for i in range(N_STATE):
                out[next_sample, i] = dense_at(y, dense, degree, i, s)
        modes[next_sample, 0] = mode[0]
        modes[next_sample, 1] = mode[1]
        next_sample += 1
    return next_sample


@kernel
def copy_sensitivity(sens, sens_out, row):
    """Keep the present sensitivities as those of sample `row`."""
    for r in range(N_STATE):
        for c in range(N_COLUMNS):
            sens_out[row, r, c] = sens[r, c]


@kernel
def advance(
    p, y, mode, clock, breaks, pieces, t_eval, out, modes, log, sens, sens_out, stats, tableau,
    options, scratch,
):  # fmt: skip
    """Integrate from `clock[0]` to `breaks[-1]`, all arrays updated in place.

    Args:
        p: flat parameters, shape (SIZE,).
        y: state (twist, omega_u, omega_l, theta_l), shape (4,).
        mode: (upper, lower, clamped), shape (3,).
        clock: (time in s, next step in s, largest |omega_l| so far in rad/s), shape (3,).
        breaks: ends of the voltage pieces in s, shape (n + 1,).
        pieces: polynomial coefficients in the share of each piece, shape (n, d).
        t_eval: sample times in s, ascending, after the start; shape (m,).
        out: states at the samples, shape (m, 4).
        modes: disc modes at the samples, shape (m, 2).
        log: event log.
        sens: sensitivities (4, 18), read only if `options.sensitivity`.
        sens_out: sensitivities at the samples, shape (m, 4, 18) or empty.
        stats: (steps, rejected, events, samples written, piece), shape (5,).
        tableau: Runge-Kutta pair.
        options: tolerances.
        scratch: working arrays.

    Returns:
        Status code: `DONE`, `LOG_FULL` (call again to go on) or a failure.
    """
    last = tableau.stages
    degree = tableau.dense.shape[1]
    k, ys, dense = scratch.k, scratch.ys, scratch.dense
    t, h_next = clock[0], clock[1]
    sample = stats[3]
    piece_index = stats[4]
    chatter = 0
    while piece_index < pieces.shape[0]:
        start, end = breaks[piece_index], breaks[piece_index + 1]
        piece, length = pieces[piece_index], end - start
        while t < end:
            if log.count[0] + 8 > log.t.size:
                clock[0], clock[1], stats[3], stats[4] = t, h_next, sample, piece_index
                return LOG_FULL
            u = voltage_at(piece, length, t - start)
            fill_rates(p, mode, k, 0, y[0], y[1], y[2], u)
            if chatter < CHATTER_LIMIT:
                disc = -1
                if overdue(UPPER, p, y, mode, k, u):
                    disc = UPPER
                elif overdue(LOWER, p, y, mode, k, u):
                    disc = LOWER
                if disc >= 0:
                    change(disc, p, t, y, mode, u, log, sens, options)
                    stats[2] += 1
                    chatter += 1
                    continue
            if mode[0] == 0 and mode[1] == 0 and piece.size == 1:
                h = end - t
                while sample < t_eval.size and t_eval[sample] <= end:
                    for i in range(N_STATE):
                        out[sample, i] = y[i]
                    modes[sample, 0] = modes[sample, 1] = 0
                    if options.sensitivity:
                        copy_sensitivity(sens, sens_out, sample)
                    sample += 1
                t = end
                chatter = 0
                continue
            for i in range(N_STATE):
                ys[0, i] = y[i]
            limit = end - t
            if options.sensitivity and sample < t_eval.size:
                limit = min(limit, t_eval[sample] - t)
            # One whole step rather than a step and a sliver.
            h = min(h_next, options.max_step)
            clipped = h >= limit * (1.0 - 1e-9)
            if clipped:
                h = limit
            elif h > 0.5 * limit:
                h = 0.5 * limit
            if chatter >= CHATTER_LIMIT:
                h, clipped = min(h, 1e-7), False
            run_stages(p, mode, y, piece, length, t - start, h, tableau, k, ys, 1, last)
            error = error_norm(y, ys, k, h, tableau, options.rtol, options.atol)
            stats[0] += 1
            if not error <= 1.0:
                stats[1] += 1
                factor = 0.9 * error ** (-1.0 / tableau.order) if error == error else 0.1
                h_next = h * max(0.2, factor)
                if h_next < 1e-14 * (1.0 + abs(t)):
                    clock[0], stats[3], stats[4] = t, sample, piece_index
                    return STEP_TOO_SMALL
                continue
            if stats[0] > options.max_steps:
                clock[0], stats[3], stats[4] = t, sample, piece_index
                return TOO_MANY_STEPS
            grow = 5.0 if error == 0.0 else min(5.0, 0.9 * error ** (-1.0 / tableau.order))
            if not clipped or grow < 1.0 or h * grow > h_next:
                h_next = h * max(grow, 0.3)
            which = -1
            h_full = h
            if chatter < CHATTER_LIMIT:
                which, h = try_event(p, mode, y, piece, length, t - start, h, tableau, scratch)
            if which >= 0 and h == 0.0:
                change(which, p, t, y, mode, u, log, sens, options)
                stats[2] += 1
                chatter += 1
                continue
            chatter = 0
            t_new = end if (clipped and h == h_full and limit == end - t) else t + h
            if clipped and h == h_full and limit != end - t:
                t_new = t_eval[sample]
            needs_dense = options.extrema and mode[1] != 0 and k[0, 2] * k[last, 2] < 0.0
            if sample < t_eval.size and t_eval[sample] < t_new:
                needs_dense = True
            if needs_dense:
                run_stages(
                    p, mode, y, piece, length, t - start, h, tableau, k, ys,
                    last + 1, last + tableau.extra,
                )  # fmt: skip
                fill_dense(h, tableau, k, 0, 3, dense)
            if options.sensitivity:
                step_sensitivity(
                    p, mode, sens, piece, length, t - start, h, tableau, ys, scratch.ks,
                    scratch.work, scratch.jac, scratch.rates,
                )  # fmt: skip
            first = sample
            sample = write_samples(
                t, t_new, y, h, sample, t_eval, out, modes, mode, dense, degree, ys[last]
            )
            if options.sensitivity and sample > first:
                copy_sensitivity(sens, sens_out, first)
            if options.extrema and mode[1] != 0:
                note_extremum(p, t, y, h, degree, scratch, last, log)
            for i in range(N_STATE):
                y[i] = ys[last, i]
            clock[2] = max(clock[2], abs(y[2]))
            t = t_new
            if which >= 0:
                u = voltage_at(piece, length, t - start)
                change(which, p, t, y, mode, u, log, sens, options)
                stats[2] += 1
        piece_index += 1
    clock[0], clock[1], stats[3], stats[4] = t, h_next, sample, piece_index
    return DONE
