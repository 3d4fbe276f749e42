"""Compiled sensitivities of a Dormand-Prince step: the loops of `_variational`, unrolled.

Written out because the filter spends most of its time here: a column's stages stay in registers,
and several columns go at once.
"""

from drill_env._jit import unit
from drill_env.integrator._dopri5 import (
    A10,
    A20,
    A21,
    A30,
    A31,
    A32,
    A40,
    A41,
    A42,
    A43,
    A50,
    A51,
    A52,
    A53,
    A54,
    B0,
    B2,
    B3,
    B4,
    B5,
)
from drill_env.integrator._stage import fill_forces
from drill_env.integrator.signatures import FILL


@unit(FILL)
def dopri5_sensitivity(p, run, work, tab, h):
    """Carry `work.sens` over the accepted step of `h` s whose stages are in `work`."""
    fill_forces(p, run, work, tab, h)
    s, g, columns = work.sens, work.force, work.columns
    a, b, d = work.jac[0], work.jac[1], work.jac[2]
    e0, e1, e2 = work.slopes[0], work.slopes[1], work.slopes[2]
    e3, e4, e5 = work.slopes[3], work.slopes[4], work.slopes[5]
    for c in range(columns):
        x, v, w = s[0, c], s[1, c], s[2, c]
        x0, v0, w0 = v - w, a * x + b * v + g[0, 0, c], d * x + e0 * w + g[0, 1, c]
        xs, vs, ws = x + h * A10 * x0, v + h * A10 * v0, w + h * A10 * w0
        x1, v1, w1 = vs - ws, a * xs + b * vs + g[1, 0, c], d * xs + e1 * ws + g[1, 1, c]
        xs = x + h * (A20 * x0 + A21 * x1)
        vs = v + h * (A20 * v0 + A21 * v1)
        ws = w + h * (A20 * w0 + A21 * w1)
        q2 = ws
        x2, v2, w2 = vs - ws, a * xs + b * vs + g[2, 0, c], d * xs + e2 * ws + g[2, 1, c]
        xs = x + h * (A30 * x0 + A31 * x1 + A32 * x2)
        vs = v + h * (A30 * v0 + A31 * v1 + A32 * v2)
        ws = w + h * (A30 * w0 + A31 * w1 + A32 * w2)
        q3 = ws
        x3, v3, w3 = vs - ws, a * xs + b * vs + g[3, 0, c], d * xs + e3 * ws + g[3, 1, c]
        xs = x + h * (A40 * x0 + A41 * x1 + A42 * x2 + A43 * x3)
        vs = v + h * (A40 * v0 + A41 * v1 + A42 * v2 + A43 * v3)
        ws = w + h * (A40 * w0 + A41 * w1 + A42 * w2 + A43 * w3)
        q4 = ws
        x4, v4, w4 = vs - ws, a * xs + b * vs + g[4, 0, c], d * xs + e4 * ws + g[4, 1, c]
        xs = x + h * (A50 * x0 + A51 * x1 + A52 * x2 + A53 * x3 + A54 * x4)
        vs = v + h * (A50 * v0 + A51 * v1 + A52 * v2 + A53 * v3 + A54 * v4)
        ws = w + h * (A50 * w0 + A51 * w1 + A52 * w2 + A53 * w3 + A54 * w4)
        q5 = ws
        x5, v5, w5 = vs - ws, a * xs + b * vs + g[5, 0, c], d * xs + e5 * ws + g[5, 1, c]
        s[0, c] = x + h * (B0 * x0 + B2 * x2 + B3 * x3 + B4 * x4 + B5 * x5)
        s[1, c] = v + h * (B0 * v0 + B2 * v2 + B3 * v3 + B4 * v4 + B5 * v5)
        s[2, c] = w + h * (B0 * w0 + B2 * w2 + B3 * w3 + B4 * w4 + B5 * w5)
        s[3, c] += h * (B0 * w + B2 * q2 + B3 * q3 + B4 * q4 + B5 * q5)
