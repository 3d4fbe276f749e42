"""Compiled run of one inertia under a sampled position law, with exact sensitivities."""

import numpy as np

from drill_env._jit import entry, kernel
from drill_env.integrator.advance import DONE, LOG_FULL, advance
from drill_env.integrator.modes import start_mode
from drill_env.integrator.records import FIRST_PARAMETER, LOAD_U, N_STATE

# km, Ju, Tsu, dTsu, bu, dbu: the first parameters of all.
N_SLOPES = 6

LAW = np.dtype(
    [("kp", "f8"), ("kv", "f8"), ("limit", "f8"), ("span", "i8"), ("delay", "i8")], align=True
)
"""A position law, see `PositionLaw`."""


@kernel
def law_voltage(law, k, dt, reference, added, y):
    """Voltage (V) of the law at row `k` before its limit."""
    now = k - law.delay
    speed = (y[now] - y[now - law.span]) / (law.span * dt)
    return law.kv * (law.kp * (reference[now] - y[now]) - speed) + added[k]


@kernel
def law_slopes(law, k, dt, slopes, row):
    """Derivatives of that voltage by the parameters, from those of the position."""
    now = k - law.delay
    for c in range(N_SLOPES):
        speed = (slopes[now, c, 0] - slopes[now - law.span, c, 0]) / (law.span * dt)
        row[c, 1] = -law.kv * (law.kp * slopes[now, c, 0] + speed)


@kernel
def hold(p, run, work, tab, seconds, volts, buffers):
    """Carry the axis on under a held voltage; returns the status of `advance`."""
    buffers.breaks[1] = seconds
    buffers.piece[0, 0] = volts
    run.t = 0.0
    run.piece = run.sample = run.steps = 0
    for i in range(N_STATE):
        for c in range(work.columns):
            work.sens[i, c] = 1.0 if i == c else 0.0
    status = LOG_FULL
    while status == LOG_FULL:
        run.logged = 0
        status = advance(
            p, run, work, tab, buffers.breaks, buffers.piece, buffers.t_eval, buffers.out,
            buffers.modes, buffers.log, buffers.sens,
        )  # fmt: skip
    return status


@kernel
def carry_slopes(p, work, slopes, row, state):
    """Sensitivities of (position, velocity) over the hold just run, in `state`."""
    for c in range(N_SLOPES):
        x, v = state[c, 0], state[c, 1]
        for i in range(2):
            moved = work.sens[i, 0] * x + work.sens[i, 1] * v
            # A volt pulls as km newton metres from outside do.
            moved += work.sens[i, LOAD_U] * p.km * slopes[row, c, 1]
            moved += work.sens[i, FIRST_PARAMETER + c]
            state[c, i] = moved


@entry
def run_loop(p, run, work, tab, law, t, dt, reference, added, u, y, slopes, state, buffers):
    """Run the loop through all rows.

    Args:
        p: record of `PARAMETERS`.
        run: record of `RUN`, the first state.
        work: record of `WORK`.
        tab: record of `TABLEAU`.
        law: record of `LAW`.
        t: times in s, shape (n,).
        dt: sampling interval that the law divides by, s.
        reference: position asked for, shape (n,).
        added: voltage that acts beside the law, V, shape (n,).
        u: voltages in V, shape (n,); the first rows, where the law lacks its past, are read,
            the others filled.
        y: filled with the positions, shape (n,).
        slopes: filled with the derivatives of (y, u), shape (n, 6, 2), or no rows.
        state: derivatives of (position, velocity), zero at the start, shape (6, 2).
        buffers: working arrays.

    Returns:
        `DONE` or a failure of the integrator.
    """
    for k in range(t.size):
        y[k] = run.y[0]
        wanted = slopes.shape[0] > 0
        if wanted:
            for c in range(N_SLOPES):
                slopes[k, c, 0] = state[c, 0]
        if k >= law.delay + law.span:
            volts = law_voltage(law, k, dt, reference, added, y)
            u[k] = min(max(volts, -law.limit), law.limit)
            if wanted and u[k] == volts:
                law_slopes(law, k, dt, slopes, slopes[k])
        if k == 0:
            start_mode(p, run, u[0])
        if k + 1 < t.size:
            status = hold(p, run, work, tab, t[k + 1] - t[k], u[k], buffers)
            if status != DONE:
                return status
            if wanted:
                carry_slopes(p, work, slopes, k, state)
    return DONE
