"""Compiled Dormand-Prince step, its stages unrolled: the coefficients are SciPy's.

Written out because environments spend most of their time here: the general loops read each
coefficient from memory.
"""

from math import sqrt

import numpy as np
from scipy.integrate import RK45

from drill_env._jit import unit
from drill_env.integrator._step import along, keep_stage, scaled, weighed
from drill_env.integrator._variational import column_rates, fill_forces
from drill_env.integrator.records import N_STATE, THETA_L
from drill_env.integrator.signatures import FILL, STEP

LAST = 6

# What weighs nothing is left out: rates 1 of the step, and of its error and dense output.
A1, A2, A3, A4, A5 = (tuple(map(float, RK45.A[i, :i])) for i in range(1, LAST))
B = tuple(map(float, np.delete(RK45.B, 1)))
E = tuple(map(float, np.delete(RK45.E, 1)))
# Of s^2, s^3, s^4; that of s is rate 0 itself.
P2, P3, P4 = (tuple(map(float, np.delete(column, 1))) for column in RK45.P.T[1:])


@unit(STEP)
def dopri5_step(p, run, work, tab, h):
    """Fill the stages; returns the scaled error, of which at most 1 is accepted."""
    ys, k = work.ys, work.k
    y, k0 = (ys[0, 0], ys[0, 1], ys[0, 2]), (k[0, 0], k[0, 1], k[0, 2])
    k1 = keep_stage(p, run, work, tab, h, 1, along(y, h, A1, (k0,)))
    k2 = keep_stage(p, run, work, tab, h, 2, along(y, h, A2, (k0, k1)))
    k3 = keep_stage(p, run, work, tab, h, 3, along(y, h, A3, (k0, k1, k2)))
    k4 = keep_stage(p, run, work, tab, h, 4, along(y, h, A4, (k0, k1, k2, k3)))
    k5 = keep_stage(p, run, work, tab, h, 5, along(y, h, A5, (k0, k1, k2, k3, k4)))
    ys[LAST, 3] = ys[0, 3] + h * weighed(B, (k[0, 3], k[2, 3], k[3, 3], k[4, 3], k[5, 3]))
    end = along(y, h, B, (k0, k2, k3, k4, k5))
    keep_stage(p, run, work, tab, h, LAST, end)
    total = 0.0
    for i in range(N_STATE + work.inner):
        if i != THETA_L:
            rates = k[0, i], k[2, i], k[3, i], k[4, i], k[5, i], k[6, i]
            total += (weighed(E, rates) * scaled(work, i, LAST)) ** 2
    return h * sqrt(total / (3.0 + work.inner))


@unit(FILL)
def dopri5_fill(p, run, work, tab, h):
    """Monomial coefficients of the state over the step."""
    k, d = work.k, work.dense
    for i in range(N_STATE + work.inner):
        rates = k[0, i], k[2, i], k[3, i], k[4, i], k[5, i], k[6, i]
        d[i, 0] = h * k[0, i]
        d[i, 1], d[i, 2] = h * weighed(P2, rates), h * weighed(P3, rates)
        d[i, 3] = h * weighed(P4, rates)


@unit(FILL)
def dopri5_sensitivity(p, run, work, tab, h):
    """Carry `work.sens` over the accepted step of `h` s whose stages are in `work`.

    The loops of `_variational`, unrolled: the filter spends most of its time here, where a column's
    stages stay in registers, and several columns go at once.
    """
    fill_forces(p, run, work, tab, h)
    s, g, slopes = work.sens, work.force, work.slopes
    a, b, d = work.jac[0], work.jac[1], work.jac[2]
    e0, e1, e2, e3, e4, e5 = slopes[0], slopes[1], slopes[2], slopes[3], slopes[4], slopes[5]
    for c in range(work.columns):
        y = s[0, c], s[1, c], s[2, c]
        k0 = column_rates(a, b, d, e0, g[0, 0, c], g[0, 1, c], y)
        k1 = column_rates(a, b, d, e1, g[1, 0, c], g[1, 1, c], along(y, h, A1, (k0,)))
        y2 = along(y, h, A2, (k0, k1))
        k2 = column_rates(a, b, d, e2, g[2, 0, c], g[2, 1, c], y2)
        y3 = along(y, h, A3, (k0, k1, k2))
        k3 = column_rates(a, b, d, e3, g[3, 0, c], g[3, 1, c], y3)
        y4 = along(y, h, A4, (k0, k1, k2, k3))
        k4 = column_rates(a, b, d, e4, g[4, 0, c], g[4, 1, c], y4)
        y5 = along(y, h, A5, (k0, k1, k2, k3, k4))
        k5 = column_rates(a, b, d, e5, g[5, 0, c], g[5, 1, c], y5)
        s[0, c], s[1, c], s[2, c] = along(y, h, B, (k0, k2, k3, k4, k5))
        s[3, c] += h * weighed(B, (y[2], y2[2], y3[2], y4[2], y5[2]))
