"""Compiled DOP853 step, its stages unrolled: the coefficients are SciPy's, without the zeros."""

from math import sqrt

from numba import int64
from scipy.integrate import DOP853

from drill_env._jit import kernel, unit
from drill_env.integrator._stage import along, keep_stage
from drill_env.integrator._step import fill_rates, inner_errors, scaled
from drill_env.integrator.records import N_STATE
from drill_env.integrator.signatures import FILL, STEP

LAST = 12
# After the start's, the first stage that the solution, its error or its dense output read.
FIRST_USED = 5

A1, A2, A3, A4, A5, A6, A7, A8, A9, A10, A11, B = (
    tuple(float(weight) for weight in row if weight != 0.0) for row in (*DOP853.A[1:], DOP853.B)
)


@kernel
def dop853_stages(p, run, work, tab, h):
    """Fill stages 1 to 12 of a step of `h` s."""
    ys, k = work.ys, work.k
    y, k0 = (ys[0, 0], ys[0, 1], ys[0, 2]), (k[0, 0], k[0, 1], k[0, 2])
    end = along(y, h, A1, (k0,))
    k1 = keep_stage(p, run, work, tab, h, int64(1), end)
    end = along(y, h, A2, (k0, k1))
    k2 = keep_stage(p, run, work, tab, h, int64(2), end)
    end = along(y, h, A3, (k0, k2))
    k3 = keep_stage(p, run, work, tab, h, int64(3), end)
    end = along(y, h, A4, (k0, k2, k3))
    k4 = keep_stage(p, run, work, tab, h, int64(4), end)
    end = along(y, h, A5, (k0, k3, k4))
    k5 = keep_stage(p, run, work, tab, h, int64(5), end)
    end = along(y, h, A6, (k0, k3, k4, k5))
    k6 = keep_stage(p, run, work, tab, h, int64(6), end)
    end = along(y, h, A7, (k0, k3, k4, k5, k6))
    k7 = keep_stage(p, run, work, tab, h, int64(7), end)
    end = along(y, h, A8, (k0, k3, k4, k5, k6, k7))
    k8 = keep_stage(p, run, work, tab, h, int64(8), end)
    end = along(y, h, A9, (k0, k3, k4, k5, k6, k7, k8))
    k9 = keep_stage(p, run, work, tab, h, int64(9), end)
    end = along(y, h, A10, (k0, k3, k4, k5, k6, k7, k8, k9))
    k10 = keep_stage(p, run, work, tab, h, int64(10), end)
    end = along(y, h, A11, (k0, k3, k4, k5, k6, k7, k8, k9, k10))
    k11 = keep_stage(p, run, work, tab, h, int64(11), end)
    end = along(y, h, B, (k0, k5, k6, k7, k8, k9, k10, k11))
    keep_stage(p, run, work, tab, h, int64(LAST), end)
    angle = B[0] * k[0, 3]
    for j in range(1, len(B)):
        angle += B[j] * k[FIRST_USED - 1 + j, 3]
    ys[LAST, 3] = ys[0, 3] + h * angle


@unit(STEP)
def dop853_step(p, run, work, tab, h):
    """Fill the stages; returns the scaled error, of which at most 1 is accepted."""
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
    """Monomial coefficients of the state over the step, with the stages that this takes."""
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
