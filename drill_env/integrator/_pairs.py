"""Compiled steps of the three Runge-Kutta pairs, with their error estimates and dense output."""

from math import sqrt

from drill_env._jit import inlined, kernel, unit
from drill_env.integrator._bs23 import bs23_dense, bs23_error, bs23_stages
from drill_env.integrator._dop853 import FIRST_USED, dop853_stages
from drill_env.integrator._dopri5 import dopri5_dense, dopri5_error, dopri5_stages
from drill_env.integrator._step import fill_rates
from drill_env.integrator.records import N_STATE
from drill_env.integrator.signatures import FILL, STEP


@inlined
def scaled(work, i, last):
    """Reciprocal of the error allowed in state component `i`."""
    size = max(abs(work.ys[0, i]), abs(work.ys[last, i]))
    return 1.0 / (work.atol + work.rtol * size)


@kernel
def inner_errors(work, tab):
    """Squared scaled errors of the inner states by both estimates, before the step's length."""
    n, high2, low2 = tab.stages, 0.0, 0.0
    for r in range(work.inner):
        high = low = 0.0
        for j in range(n + 1):
            high += tab.error_high[j] * work.kz[j, r]
            low += tab.error_low[j] * work.kz[j, r]
        size = max(abs(work.zs[0, r]), abs(work.zs[n, r]))
        scale = 1.0 / (work.atol + work.rtol * size)
        high2 += (high * scale) ** 2
        low2 += (low * scale) ** 2
    return high2, low2


@unit(STEP)
def bs23_step(p, run, work, tab, h):
    """Fill the stages; returns the scaled error, of which at most 1 is accepted."""
    bs23_stages(p, run, work, tab, h)
    total = 0.0
    for i in range(3):
        total += (bs23_error(work.k, i) * scaled(work, i, tab.stages)) ** 2
    if work.inner != 0:
        total += inner_errors(work, tab)[0]
    return h * sqrt(total / (3.0 + work.inner))


@unit(STEP)
def dopri5_step(p, run, work, tab, h):
    """As `bs23_step`."""
    dopri5_stages(p, run, work, tab, h)
    total = 0.0
    for i in range(3):
        total += (dopri5_error(work.k, i) * scaled(work, i, tab.stages)) ** 2
    if work.inner != 0:
        total += inner_errors(work, tab)[0]
    return h * sqrt(total / (3.0 + work.inner))


@unit(STEP)
def dop853_step(p, run, work, tab, h):
    """As `bs23_step`."""
    dop853_stages(p, run, work, tab, h)
    n, k = tab.stages, work.k
    high2 = low2 = 0.0
    for i in range(3):
        high, low = tab.error_high[0] * k[0, i], tab.error_low[0] * k[0, i]
        for j in range(FIRST_USED, n + 1):
            high += tab.error_high[j] * k[j, i]
            low += tab.error_low[j] * k[j, i]
        scale = scaled(work, i, n)
        high2 += (high * scale) ** 2
        low2 += (low * scale) ** 2
    if work.inner != 0:
        inner_high2, inner_low2 = inner_errors(work, tab)
        high2, low2 = high2 + inner_high2, low2 + inner_low2
    if high2 == 0.0:
        return 0.0
    # Hairer's combination of the fifth and third order estimates (DOP853).
    return h * high2 / sqrt((high2 + 0.01 * low2) * (3.0 + work.inner))


@unit(FILL)
def bs23_fill(p, run, work, tab, h):
    """Monomial coefficients of the state over the step."""
    bs23_dense(work, h)


@unit(FILL)
def dopri5_fill(p, run, work, tab, h):
    """As `bs23_fill`."""
    dopri5_dense(work, h)


@kernel
def extra_stages(p, run, work, tab, h, first, last):
    """Stages `first`..`last`, which serve the dense output alone."""
    ys, k = work.ys, work.k
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
        fill_rates(p, run, work, tab, h, i)


@unit(FILL)
def dop853_fill(p, run, work, tab, h):
    """As `bs23_fill`, with the stages that this takes."""
    last = tab.stages + tab.extra
    extra_stages(p, run, work, tab, h, tab.stages + 1, last)
    k, d, w = work.k, work.dense, tab.dense
    for i in range(N_STATE):
        k0 = k[0, i]
        d0, d1, d2, d3 = w[0, 0] * k0, w[0, 1] * k0, w[0, 2] * k0, w[0, 3] * k0
        d4, d5, d6 = w[0, 4] * k0, w[0, 5] * k0, w[0, 6] * k0
        for j in range(FIRST_USED, last + 1):
            kj = k[j, i]
            d0 += w[j, 0] * kj
            d1 += w[j, 1] * kj
            d2 += w[j, 2] * kj
            d3 += w[j, 3] * kj
            d4 += w[j, 4] * kj
            d5 += w[j, 5] * kj
            d6 += w[j, 6] * kj
        d[i, 0], d[i, 1], d[i, 2], d[i, 3] = h * d0, h * d1, h * d2, h * d3
        d[i, 4], d[i, 5], d[i, 6] = h * d4, h * d5, h * d6
