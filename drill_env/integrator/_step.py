"""Compiled Runge-Kutta step in one mode, its error estimate and its dense output.

The start of the step is stage 0 of `work.ys`; the state at its end stage `tab.stages`.
"""

from math import sqrt

from drill_env._jit import inlined, kernel
from drill_env.integrator._bs23 import bs23_dense, bs23_error, bs23_stages
from drill_env.integrator._dop853 import dop853_stages
from drill_env.integrator._dopri5 import dopri5_dense, dopri5_error, dopri5_stages
from drill_env.integrator._records import BS23, DOP853, DOPRI5, N_STATE
from drill_env.integrator._stage import keep_stage
from drill_env.integrator._voltage_piece import voltage_at


@inlined
def fill_rates(p, run, work, stage, u):
    """Rates of one stage from its state."""
    ys = work.ys
    keep_stage(p, run.mode, work, stage, ys[stage, 0], ys[stage, 1], ys[stage, 2], u)


@inlined
def few_stage_voltages(run, work, tab, h):
    """Voltages (V) of stages 1 to 3 of the shortest tableau."""
    u = work.piece[0]
    if work.coefficients == 1:
        return u, u, u
    t, c = run.t, tab.c
    return (
        voltage_at(work, t + c[1] * h), voltage_at(work, t + c[2] * h), voltage_at(work, t + h),
    )  # fmt: skip


@inlined
def stage_voltages(run, work, tab, h):
    """Voltages (V) of stages 1 to 5 of a short tableau."""
    u = work.piece[0]
    if work.coefficients == 1:
        return u, u, u, u, u
    t, c = run.t, tab.c
    return (
        voltage_at(work, t + c[1] * h), voltage_at(work, t + c[2] * h),
        voltage_at(work, t + c[3] * h), voltage_at(work, t + c[4] * h), voltage_at(work, t + h),
    )  # fmt: skip


@kernel
def long_stage_voltages(run, work, tab, h):
    """Voltages (V) of stages 1 to 12 of a long tableau."""
    u = work.piece[0]
    if work.coefficients == 1:
        return u, u, u, u, u, u, u, u, u, u, u, u
    t, c = run.t, tab.c
    return (
        voltage_at(work, t + c[1] * h), voltage_at(work, t + c[2] * h),
        voltage_at(work, t + c[3] * h), voltage_at(work, t + c[4] * h),
        voltage_at(work, t + c[5] * h), voltage_at(work, t + c[6] * h),
        voltage_at(work, t + c[7] * h), voltage_at(work, t + c[8] * h),
        voltage_at(work, t + c[9] * h), voltage_at(work, t + c[10] * h),
        voltage_at(work, t + c[11] * h), voltage_at(work, t + h),
    )  # fmt: skip


@kernel
def run_stages(p, run, work, tab, h, first, last):
    """Fill stages `first`..`last` of a step of `h` s from the present state."""
    if tab.pair != DOP853:
        if first == 1 and tab.pair == BS23:
            bs23_stages(p, run, work, h, few_stage_voltages(run, work, tab, h))
        elif first == 1:
            dopri5_stages(p, run, work, h, stage_voltages(run, work, tab, h))
        return
    if first == 1:
        dop853_stages(p, run, work, h, long_stage_voltages(run, work, tab, h))
        return
    ys, k = work.ys, work.k
    u = work.piece[0]
    for i in range(first, last + 1):
        d0 = d1 = d2 = d3 = 0.0
        for j in range(i):
            w = tab.a[i, j]
            if w != 0.0:
                d0 += w * k[j, 0]
                d1 += w * k[j, 1]
                d2 += w * k[j, 2]
                d3 += w * k[j, 3]
        ys[i, 0] = ys[0, 0] + h * d0
        ys[i, 1] = ys[0, 1] + h * d1
        ys[i, 2] = ys[0, 2] + h * d2
        ys[i, 3] = ys[0, 3] + h * d3
        if work.coefficients > 1:
            u = voltage_at(work, run.t + tab.c[i] * h)
        fill_rates(p, run, work, i, u)


@kernel
def error_norm(work, tab, h):
    """Scaled error of the step just taken; at most 1 is accepted."""
    n = tab.stages
    if tab.pair != DOP853:
        total = 0.0
        for i in range(3):
            size = max(abs(work.ys[0, i]), abs(work.ys[n, i]))
            rate = bs23_error(work.k, i) if tab.pair == BS23 else dopri5_error(work.k, i)
            total += (rate / (work.atol + work.rtol * size)) ** 2
        return h * sqrt(total / 3.0)
    high2 = low2 = 0.0
    for i in range(3):
        high = low = 0.0
        for j in range(n + 1):
            high += tab.error_high[j] * work.k[j, i]
            low += tab.error_low[j] * work.k[j, i]
        size = max(abs(work.ys[0, i]), abs(work.ys[n, i]))
        scale = 1.0 / (work.atol + work.rtol * size)
        high2 += (high * scale) ** 2
        low2 += (low * scale) ** 2
    if high2 == 0.0:
        return 0.0
    # Hairer's combination of the fifth and third order estimates (DOP853).
    return h * high2 / sqrt((high2 + 0.01 * low2) * 3.0)


@kernel
def fill_dense(p, run, work, tab, h):
    """Monomial coefficients of the state over the step, with the stages they need."""
    if tab.pair == BS23:
        bs23_dense(work, h)
        return
    if tab.pair == DOPRI5:
        dopri5_dense(work, h)
        return
    last = tab.stages + tab.extra
    run_stages(p, run, work, tab, h, tab.stages + 1, last)
    for i in range(N_STATE):
        for m in range(tab.degree):
            total = 0.0
            for j in range(last + 1):
                total += tab.dense[j, m] * work.k[j, i]
            work.dense[i, m] = h * total


@inlined
def dense_at(work, tab, component, s):
    """State component at share `s` of the step."""
    value = work.dense[component, tab.degree - 1]
    for m in range(tab.degree - 2, -1, -1):
        value = value * s + work.dense[component, m]
    return work.ys[0, component] + value * s
