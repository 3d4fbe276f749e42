"""Compiled DOP853 step, its stages unrolled: the coefficients are SciPy's, without the zeros."""

from numba import int64
from scipy.integrate import DOP853

from drill_env._jit import kernel
from drill_env.integrator._stage import along, keep_stage

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
