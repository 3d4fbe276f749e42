"""Compiled Bogacki-Shampine step of order 3: for intervals that are short beside the motion.

The filter integrates from sample to sample; a higher order buys it digits below its tolerance.
"""

from math import sqrt

from drill_env._jit import unit
from drill_env.integrator._step import along, keep_stage, scaled, weighed
from drill_env.integrator._variational import column_rates, fill_forces
from drill_env.integrator.records import N_STATE, THETA_L
from drill_env.integrator.signatures import FILL, STEP

STAGES = 3

A1, A2, B, E = (1 / 2,), (3 / 4,), (2 / 9, 1 / 3, 4 / 9), (5 / 72, -1 / 12, -1 / 9, 1 / 8)
# Dense output: coefficients of s^2, s^3 (that of s is stage 0 itself).
P2, P3 = (-4 / 3, 1.0, 4 / 3, -1.0), (5 / 9, -2 / 3, -8 / 9, 1.0)


@unit(STEP)
def bs23_step(p, run, work, tab, h):
    """Fill the stages; returns the scaled error, of which at most 1 is accepted."""
    ys, k = work.ys, work.k
    y, k0 = (ys[0, 0], ys[0, 1], ys[0, 2]), (k[0, 0], k[0, 1], k[0, 2])
    k1 = keep_stage(p, run, work, tab, h, 1, along(y, h, A1, (k0,)))
    k2 = keep_stage(p, run, work, tab, h, 2, along(y, h, A2, (k1,)))
    ys[STAGES, 3] = ys[0, 3] + h * weighed(B, (k[0, 3], k[1, 3], k[2, 3]))
    end = along(y, h, B, (k0, k1, k2))
    keep_stage(p, run, work, tab, h, STAGES, end)
    total = 0.0
    for i in range(N_STATE + work.inner):
        if i != THETA_L:
            rates = k[0, i], k[1, i], k[2, i], k[3, i]
            total += (weighed(E, rates) * scaled(work, i, STAGES)) ** 2
    return h * sqrt(total / (3.0 + work.inner))


@unit(FILL)
def bs23_fill(p, run, work, tab, h):
    """Monomial coefficients of the state over the step."""
    k, d = work.k, work.dense
    for i in range(N_STATE + work.inner):
        rates = k[0, i], k[1, i], k[2, i], k[3, i]
        d[i, 0], d[i, 1], d[i, 2] = h * k[0, i], h * weighed(P2, rates), h * weighed(P3, rates)


@unit(FILL)
def bs23_sensitivity(p, run, work, tab, h):
    """Carry `work.sens` over the accepted step of `h` s whose stages are in `work`."""
    fill_forces(p, run, work, tab, h)
    s, g = work.sens, work.force
    a, b, d = work.jac[0], work.jac[1], work.jac[2]
    e0, e1, e2 = work.slopes[0], work.slopes[1], work.slopes[2]
    for c in range(work.columns):
        y = s[0, c], s[1, c], s[2, c]
        k0 = column_rates(a, b, d, e0, g[0, 0, c], g[0, 1, c], y)
        y1 = along(y, h, A1, (k0,))
        k1 = column_rates(a, b, d, e1, g[1, 0, c], g[1, 1, c], y1)
        y2 = along(y, h, A2, (k1,))
        k2 = column_rates(a, b, d, e2, g[2, 0, c], g[2, 1, c], y2)
        s[0, c], s[1, c], s[2, c] = along(y, h, B, (k0, k1, k2))
        s[3, c] += h * weighed(B, (y[2], y1[2], y2[2]))
