"""Compiled DOP853 step, its stages unrolled: the coefficients are SciPy's, without the zeros."""

from math import sqrt

from scipy.integrate import DOP853

from drill_env._jit import unit
from drill_env.integrator._step import along, fill_rates, keep_stage, scaled, weighed
from drill_env.integrator.records import N_STATE, THETA_L
from drill_env.integrator.signatures import FILL, STEP

LAST, DEGREE = 12, 7
# After the start's, the first stage that the solution, its error or its dense output read.
FIRST_USED = 5

A1, A2, A3, A4, A5, A6, A7, A8, A9, A10, A11, B = (
    tuple(float(weight) for weight in row if weight != 0.0) for row in (*DOP853.A[1:], DOP853.B)
)


@unit(STEP)
def dop853_step(p, run, work, tab, h):
    """Fill the stages; returns the scaled error, of which at most 1 is accepted."""
    ys, k = work.ys, work.k
    y, k0 = (ys[0, 0], ys[0, 1], ys[0, 2]), (k[0, 0], k[0, 1], k[0, 2])
    k1 = keep_stage(p, run, work, tab, h, 1, along(y, h, A1, (k0,)))
    k2 = keep_stage(p, run, work, tab, h, 2, along(y, h, A2, (k0, k1)))
    k3 = keep_stage(p, run, work, tab, h, 3, along(y, h, A3, (k0, k2)))
    k4 = keep_stage(p, run, work, tab, h, 4, along(y, h, A4, (k0, k2, k3)))
    k5 = keep_stage(p, run, work, tab, h, 5, along(y, h, A5, (k0, k3, k4)))
    k6 = keep_stage(p, run, work, tab, h, 6, along(y, h, A6, (k0, k3, k4, k5)))
    k7 = keep_stage(p, run, work, tab, h, 7, along(y, h, A7, (k0, k3, k4, k5, k6)))
    k8 = keep_stage(p, run, work, tab, h, 8, along(y, h, A8, (k0, k3, k4, k5, k6, k7)))
    k9 = keep_stage(p, run, work, tab, h, 9, along(y, h, A9, (k0, k3, k4, k5, k6, k7, k8)))
    end = along(y, h, A10, (k0, k3, k4, k5, k6, k7, k8, k9))
    k10 = keep_stage(p, run, work, tab, h, 10, end)
    end = along(y, h, A11, (k0, k3, k4, k5, k6, k7, k8, k9, k10))
    k11 = keep_stage(p, run, work, tab, h, 11, end)
    end = along(y, h, B, (k0, k5, k6, k7, k8, k9, k10, k11))
    keep_stage(p, run, work, tab, h, LAST, end)
    turns = k[0, 3], k[5, 3], k[6, 3], k[7, 3], k[8, 3], k[9, 3], k[10, 3], k[11, 3]
    ys[LAST, 3] = ys[0, 3] + h * weighed(B, turns)
    high2 = low2 = 0.0
    for i in range(N_STATE + work.inner):
        if i == THETA_L:
            continue
        high, low = tab.error_high[0] * k[0, i], tab.error_low[0] * k[0, i]
        for j in range(FIRST_USED, LAST + 1):
            high += tab.error_high[j] * k[j, i]
            low += tab.error_low[j] * k[j, i]
        scale = scaled(work, i, LAST)
        high2 += (high * scale) ** 2
        low2 += (low * scale) ** 2
    if high2 == 0.0:
        return 0.0
    # Hairer's combination of the fifth and third order estimates (DOP853).
    return h * high2 / sqrt((high2 + 0.01 * low2) * (3.0 + work.inner))


@unit(FILL)
def dop853_fill(p, run, work, tab, h):
    """Monomial coefficients of the state over the step, with the stages that this takes."""
    ys, k, d, last = work.ys, work.k, work.dense, tab.stages + tab.extra
    for i in range(tab.stages + 1, last + 1):
        for m in range(N_STATE):
            ys[i, m] = ys[0, m] + h * tab.a[i, 0] * k[0, m]
        for j in range(FIRST_USED, i):
            weight = h * tab.a[i, j]
            for m in range(N_STATE):
                ys[i, m] += weight * k[j, m]
        fill_rates(p, run, work, tab, h, i)
    for i in range(N_STATE + work.inner):
        for m in range(DEGREE):
            d[i, m] = h * tab.dense[0, m] * k[0, i]
        for j in range(FIRST_USED, last + 1):
            rate = h * k[j, i]
            for m in range(DEGREE):
                d[i, m] += tab.dense[j, m] * rate
