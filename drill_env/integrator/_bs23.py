"""Compiled Bogacki-Shampine step of order 3: for intervals that are short beside the motion.

The filter integrates from sample to sample; a higher order buys it digits below its tolerance.
"""

from math import sqrt

from numba import int64

from drill_env._jit import kernel, unit
from drill_env.integrator._stage import along, fill_forces, keep_stage
from drill_env.integrator._step import inner_errors, scaled
from drill_env.integrator.records import N_STATE
from drill_env.integrator.signatures import FILL, STEP

STAGES = 3

A10, A21 = 1 / 2, 3 / 4
B0, B1, B2 = 2 / 9, 1 / 3, 4 / 9
E0, E1, E2, E3 = 5 / 72, -1 / 12, -1 / 9, 1 / 8
# Dense output: coefficients of s^2, s^3 (that of s is stage 0 itself).
P01, P02 = -4 / 3, 5 / 9
P11, P12 = 1.0, -2 / 3
P21, P22 = 4 / 3, -8 / 9
P31, P32 = -1.0, 1.0


@kernel
def bs23_stages(p, run, work, tab, h):
    """Fill stages 1 to 3 of a step of `h` s."""
    ys, k = work.ys, work.k
    y, k0 = (ys[0, 0], ys[0, 1], ys[0, 2]), (k[0, 0], k[0, 1], k[0, 2])
    k1 = keep_stage(p, run, work, tab, h, int64(1), along(y, h, (A10,), (k0,)))
    k2 = keep_stage(p, run, work, tab, h, int64(2), along(y, h, (A21,), (k1,)))
    ys[STAGES, 3] = ys[0, 3] + h * (B0 * k[0, 3] + B1 * k[1, 3] + B2 * k[2, 3])
    end = along(y, h, (B0, B1, B2), (k0, k1, k2))
    keep_stage(p, run, work, tab, h, int64(STAGES), end)


@unit(STEP)
def bs23_step(p, run, work, tab, h):
    """Fill the stages; returns the scaled error, of which at most 1 is accepted."""
    bs23_stages(p, run, work, tab, h)
    k, total = work.k, 0.0
    for i in range(3):
        error = E0 * k[0, i] + E1 * k[1, i] + E2 * k[2, i] + E3 * k[3, i]
        total += (error * scaled(work, i, tab.stages)) ** 2
    if work.inner != 0:
        total += inner_errors(work, tab)[0]
    return h * sqrt(total / (3.0 + work.inner))


@unit(FILL)
def bs23_fill(p, run, work, tab, h):
    """Monomial coefficients of the state over the step."""
    k, d = work.k, work.dense
    for i in range(N_STATE):
        k0, k1, k2, k3 = k[0, i], k[1, i], k[2, i], k[3, i]
        d[i, 0] = h * k0
        d[i, 1] = h * (P01 * k0 + P11 * k1 + P21 * k2 + P31 * k3)
        d[i, 2] = h * (P02 * k0 + P12 * k1 + P22 * k2 + P32 * k3)


@unit(FILL)
def bs23_sensitivity(p, run, work, tab, h):
    """Carry `work.sens` over the accepted step of `h` s whose stages are in `work`."""
    fill_forces(p, run, work, tab, h)
    s, g, columns = work.sens, work.force, work.columns
    a, b, d = work.jac[0], work.jac[1], work.jac[2]
    e0, e1, e2 = work.slopes[0], work.slopes[1], work.slopes[2]
    for c in range(columns):
        x, v, w = s[0, c], s[1, c], s[2, c]
        x0, v0, w0 = v - w, a * x + b * v + g[0, 0, c], d * x + e0 * w + g[0, 1, c]
        xs, vs, q1 = x + h * A10 * x0, v + h * A10 * v0, w + h * A10 * w0
        x1, v1, w1 = vs - q1, a * xs + b * vs + g[1, 0, c], d * xs + e1 * q1 + g[1, 1, c]
        xs, vs, q2 = x + h * A21 * x1, v + h * A21 * v1, w + h * A21 * w1
        x2, v2, w2 = vs - q2, a * xs + b * vs + g[2, 0, c], d * xs + e2 * q2 + g[2, 1, c]
        s[0, c] = x + h * (B0 * x0 + B1 * x1 + B2 * x2)
        s[1, c] = v + h * (B0 * v0 + B1 * v1 + B2 * v2)
        s[2, c] = w + h * (B0 * w0 + B1 * w1 + B2 * w2)
        s[3, c] += h * (B0 * w + B1 * q1 + B2 * q2)
