"""Compiled rates of one stage and forcing of its sensitivities, shared by the unrolled pairs."""

from typing import Any

from numba.core import types
from numba.extending import intrinsic

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


@intrinsic
def _along(context: Any, y: Any, h: Any, weights: Any, rates: Any) -> Any:
    # A stage waits for the rates before it alone: all else is summed while they are taken.
    def generate(context: Any, builder: Any, kind: Any, values: Any) -> Any:
        (y, h, weights, rates), take = values, builder.extract_value
        newest = len(kind.args[2]) - 1
        share, ends = builder.fmul(h, take(weights, newest)), []
        for i in range(3):
            end = take(y, i)
            if newest > 0:
                total = builder.fmul(take(weights, 0), take(rates, [0, i]))
                for j in range(1, newest):
                    total = builder.fma(take(weights, j), take(rates, [j, i]), total)
                end = builder.fma(h, total, end)
            ends.append(builder.fma(share, take(rates, [newest, i]), end))
        return context.make_tuple(builder, kind.return_type, ends)

    return types.UniTuple(types.float64, 3)(y, h, weights, rates), generate


along: Any = _along
"""For kernels: `along(y, h, weights, rates)`, y + h sum of weights times rates.

States and rates are tuples of three as `keep_stage` has them, the newest rates last.
"""


@inlined
def weighed(weights, rates):
    """Sum of weights times rates, both tuples."""
    total = weights[0] * rates[0]
    for j in range(1, len(weights)):
        total += weights[j] * rates[j]
    return total


@inlined
def column_rates(a, b, d, slope, force_u, force_l, y):
    """Rates of a column of the sensitivities by `jac`, the lower law's slope and what drives it."""
    x, v, w = y
    return v - w, a * x + b * v + force_u, d * x + slope * w + force_l


@inlined
def keep_stage(p, run, work, tab, h, i, y):
    """Store state `y`, rates and the lower law's shares of stage `i`; returns the rates."""
    mode, ys, k, shares = run.mode, work.ys, work.k, work.shares
    # A constant voltage asks for no time.
    u = work.piece[0] if work.coefficients == 1 else voltage_at(work, run.t + tab.c[i] * h)
    x, v, w = y
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
