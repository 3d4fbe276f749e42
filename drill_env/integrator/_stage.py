"""Compiled rates of one stage and forcing of its sensitivities, shared by the unrolled pairs."""

from drill_env._jit import inlined
from drill_env.dynamics.kernels import (
    fill_linear,
    fill_parameter_rates,
    lower_rate_slope,
    lower_rate_with,
    upper_rate,
)
from drill_env.integrator._voltage_piece import voltage_at
from drill_env.integrator.records import FIRST_PARAMETER, LOAD_L, LOAD_U
from drill_env.integrator.signatures import call_stage


@inlined
def keep_stage(p, run, work, tab, h, i, x, v, w, u):
    """Store state, rates and the lower law's shares of stage `i`; returns the rates."""
    mode, ys, k, shares = run.mode, work.ys, work.k, work.shares
    ys[i, 0], ys[i, 1], ys[i, 2] = x, v, w
    if work.acting != 0:
        call_stage(tab.stage, p, run, work, tab, h, i, u)
        return k[i, 0], k[i, 1], k[i, 2]
    rate_x = v - w
    rate_v = upper_rate(p, mode[0], x, v, u)
    rate_w, shares[i, 0], shares[i, 1] = lower_rate_with(p, mode[1], mode[2], x, w)
    k[i, 0], k[i, 1], k[i, 2], k[i, 3] = rate_x, rate_v, rate_w, w
    return rate_x, rate_v, rate_w


@inlined
def fill_forces(p, run, work, tab, h):
    """What drives every column of the sensitivities at the stages before the last."""
    mode, ys, shares = run.mode, work.ys, work.shares
    fill_linear(p, mode[0], mode[1], work.jac)
    for i in range(tab.stages):
        s1, s2 = shares[i, 0], shares[i, 1]
        work.slopes[i] = lower_rate_slope(p, mode[1], mode[2], s1, s2)
        work.force[i, 0, LOAD_U] = p.per_Ju if mode[0] != 0 else 0.0
        work.force[i, 1, LOAD_L] = p.per_Jl if mode[1] != 0 else 0.0
        if work.columns > FIRST_PARAMETER:
            fill_parameter_rates(
                p, mode[0], mode[1], mode[2], ys[i, 0], ys[i, 1], ys[i, 2],
                voltage_at(work, run.t + tab.c[i] * h), work.k[i, 1], work.k[i, 2], s1, s2,
                work.force[i, 0, FIRST_PARAMETER:], work.force[i, 1, FIRST_PARAMETER:],
            )  # fmt: skip
