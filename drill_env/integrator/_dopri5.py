"""Compiled Dormand-Prince step: unrolled with literal coefficients.

Written out because environments spend most of their time here: the general loops read each
coefficient from memory.
"""

from math import sqrt

from numba import int64

from drill_env._jit import kernel, unit
from drill_env.integrator._stage import along, fill_forces, keep_stage
from drill_env.integrator._step import inner_errors, scaled
from drill_env.integrator.records import N_STATE
from drill_env.integrator.signatures import FILL, STEP

LAST = 6

A10 = 1 / 5
A20, A21 = 3 / 40, 9 / 40
A30, A31, A32 = 44 / 45, -56 / 15, 32 / 9
A40, A41, A42, A43 = 19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729
A50, A51, A52, A53, A54 = 9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656
B0, B2, B3, B4, B5 = 35 / 384, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84
E0, E2, E3 = -71 / 57600, 71 / 16695, -71 / 1920
E4, E5, E6 = 17253 / 339200, -22 / 525, 1 / 40
# Dense output: coefficients of s^2, s^3, s^4 (that of s is stage 0 itself).
P01, P02, P03 = -8048581381 / 2820520608, 8663915743 / 2820520608, -12715105075 / 11282082432
P21, P22, P23 = 131558114200 / 32700410799, -68118460800 / 10900136933, 87487479700 / 32700410799
P31, P32, P33 = -1754552775 / 470086768, 14199869525 / 1410260304, -10690763975 / 1880347072
P41, P42, P43 = 127303824393 / 49829197408, -318862633887 / 49829197408, 701980252875 / 199316789632
P51, P52, P53 = -282668133 / 205662961, 2019193451 / 616988883, -1453857185 / 822651844
P61, P62, P63 = 40617522 / 29380423, -110615467 / 29380423, 69997945 / 29380423


@kernel
def dopri5_stages(p, run, work, tab, h):
    """Fill stages 1 to 6 of a step of `h` s."""
    ys, k = work.ys, work.k
    y, k0 = (ys[0, 0], ys[0, 1], ys[0, 2]), (k[0, 0], k[0, 1], k[0, 2])
    end = along(y, h, (A10,), (k0,))
    k1 = keep_stage(p, run, work, tab, h, int64(1), end)
    end = along(y, h, (A20, A21), (k0, k1))
    k2 = keep_stage(p, run, work, tab, h, int64(2), end)
    end = along(y, h, (A30, A31, A32), (k0, k1, k2))
    k3 = keep_stage(p, run, work, tab, h, int64(3), end)
    end = along(y, h, (A40, A41, A42, A43), (k0, k1, k2, k3))
    k4 = keep_stage(p, run, work, tab, h, int64(4), end)
    end = along(y, h, (A50, A51, A52, A53, A54), (k0, k1, k2, k3, k4))
    k5 = keep_stage(p, run, work, tab, h, int64(5), end)
    ys[LAST, 3] = ys[0, 3] + h * (
        B0 * k[0, 3] + B2 * k[2, 3] + B3 * k[3, 3] + B4 * k[4, 3] + B5 * k[5, 3]
    )
    end = along(y, h, (B0, B2, B3, B4, B5), (k0, k2, k3, k4, k5))
    keep_stage(p, run, work, tab, h, int64(LAST), end)


@unit(STEP)
def dopri5_step(p, run, work, tab, h):
    """Fill the stages; returns the scaled error, of which at most 1 is accepted."""
    dopri5_stages(p, run, work, tab, h)
    k, total = work.k, 0.0
    for i in range(3):
        error = (
            E0 * k[0, i] + E2 * k[2, i] + E3 * k[3, i] + E4 * k[4, i] + E5 * k[5, i] + E6 * k[6, i]
        )
        total += (error * scaled(work, i, tab.stages)) ** 2
    if work.inner != 0:
        total += inner_errors(work, tab)[0]
    return h * sqrt(total / (3.0 + work.inner))


@unit(FILL)
def dopri5_fill(p, run, work, tab, h):
    """Monomial coefficients of the state over the step."""
    k, d = work.k, work.dense
    for i in range(N_STATE):
        k0, k2, k3, k4, k5, k6 = k[0, i], k[2, i], k[3, i], k[4, i], k[5, i], k[6, i]
        d[i, 0] = h * k0
        d[i, 1] = h * (P01 * k0 + P21 * k2 + P31 * k3 + P41 * k4 + P51 * k5 + P61 * k6)
        d[i, 2] = h * (P02 * k0 + P22 * k2 + P32 * k3 + P42 * k4 + P52 * k5 + P62 * k6)
        d[i, 3] = h * (P03 * k0 + P23 * k2 + P33 * k3 + P43 * k4 + P53 * k5 + P63 * k6)


@unit(FILL)
def dopri5_sensitivity(p, run, work, tab, h):
    """Carry `work.sens` over the accepted step of `h` s whose stages are in `work`.

    The loops of `_variational`, unrolled: the filter spends most of its time here, where a column's
    stages stay in registers, and several columns go at once.
    """
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
