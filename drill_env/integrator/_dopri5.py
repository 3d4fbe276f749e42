"""Compiled Dormand-Prince step: the loops of `_step`, unrolled with literal coefficients.

Written out because environments spend most of their time here: the general loops read each
coefficient from memory.
"""

from numba import int64

from drill_env._jit import inlined, kernel
from drill_env.integrator._stage import along, keep_stage
from drill_env.integrator.records import N_STATE

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


@inlined
def dopri5_error(k, i):
    """Rate of the error estimate of state component `i`."""
    return E0 * k[0, i] + E2 * k[2, i] + E3 * k[3, i] + E4 * k[4, i] + E5 * k[5, i] + E6 * k[6, i]


@inlined
def dopri5_dense(work, h):
    """Monomial coefficients of the state over the step."""
    k, d = work.k, work.dense
    for i in range(N_STATE):
        k0, k2, k3, k4, k5, k6 = k[0, i], k[2, i], k[3, i], k[4, i], k[5, i], k[6, i]
        d[i, 0] = h * k0
        d[i, 1] = h * (P01 * k0 + P21 * k2 + P31 * k3 + P41 * k4 + P51 * k5 + P61 * k6)
        d[i, 2] = h * (P02 * k0 + P22 * k2 + P32 * k3 + P42 * k4 + P52 * k5 + P62 * k6)
        d[i, 3] = h * (P03 * k0 + P23 * k2 + P33 * k3 + P43 * k4 + P53 * k5 + P63 * k6)
