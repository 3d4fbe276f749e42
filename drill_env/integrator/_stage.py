"""Compiled rates of one stage, shared by the unrolled pairs."""

from drill_env._jit import kernel
from drill_env.dynamics._kernels import lower_rate, upper_rate


@kernel
def keep_stage(p, mode, ys, k, i, x, v, w, u):
    """Store state and rates of stage `i`; returns the rates."""
    ys[i, 0], ys[i, 1], ys[i, 2] = x, v, w
    rate_x = v - w
    rate_v = upper_rate(p, mode[0], x, v, u)
    rate_w = lower_rate(p, mode[1], mode[2], x, w)
    k[i, 0], k[i, 1], k[i, 2], k[i, 3] = rate_x, rate_v, rate_w, w
    return rate_x, rate_v, rate_w
