"""Compiled stages of a step, its start and length, its error and its dense output.

The start of the step is stage 0 of `work.ys`; the state at its end stage `tab.stages`.
"""

from math import inf, sqrt
from typing import Any

from numba.core import types
from numba.extending import intrinsic

from drill_env._intrinsics import number_at
from drill_env._jit import inlined, kernel
from drill_env.dynamics.kernels import lower_rate_with, upper_rate
from drill_env.effects.pace import REACH
from drill_env.integrator._voltage_piece import voltage_at
from drill_env.integrator.signatures import call_stage

DONE, LOG_FULL, STEP_TOO_SMALL, TOO_MANY_STEPS = 0, 1, 2, 3

# So many mode changes at one instant are chatter: one tiny step is then taken as it is.
CHATTER_LIMIT = 12
_CHATTER_STEP = 1e-7


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
def fill_rates(p, run, work, tab, h, stage):
    """Rates of one stage from its state."""
    ys = work.ys
    keep_stage(p, run, work, tab, h, stage, (ys[stage, 0], ys[stage, 1], ys[stage, 2]))


@inlined
def dense_at(work, tab, component, s):
    """State component, or inner state, at share `s` of the step."""
    value = work.dense[component, tab.degree - 1]
    for m in range(tab.degree - 2, -1, -1):
        value = value * s + work.dense[component, m]
    return work.ys[0, component] + value * s


@inlined
def scaled(work, i, last):
    """Reciprocal of the error allowed in component `i`."""
    size = max(abs(work.ys[0, i]), abs(work.ys[last, i]))
    return 1.0 / (work.atol + work.rtol * size)


@inlined
def next_sample(run, work):
    """Time of the next sample (s), infinity after the last one."""
    return number_at(work.t_eval, run.sample) if run.sample < work.samples else inf


@inlined
def choose_step(run, work):
    """Step to try, and the time at which it ends exactly (or infinity)."""
    target = work.end
    if work.sensitivity:
        # Sensitivities have no dense output: end a step at every sample.
        target = min(target, next_sample(run, work))
    limit = target - run.t
    h = min(run.h, work.max_step)
    if work.pace[0] > 0.0:
        # So that the step times the rate at its end is in reach, if the rate grows on as it did.
        rate, growth = work.pace[0], work.pace[2]
        h = min(h, 2.0 * REACH / (rate + sqrt(rate * rate + 4.0 * growth * REACH)))
    if run.chatter >= CHATTER_LIMIT:
        h = min(h, _CHATTER_STEP)
    if h >= limit * (1.0 - 1e-9):
        return limit, target
    # Two equal steps rather than a step and a sliver.
    return min(h, 0.5 * limit) if h > 0.5 * limit else h, 1e300


@kernel
def reject(run, tab, h, error):
    """Shorten the next try; a collapse of the step is a failure."""
    run.rejected += 1
    factor = 0.8 * error ** (-1.0 / tab.order) if error == error else 0.1
    run.h = h * max(0.2, factor)
    return STEP_TOO_SMALL if run.h < 1e-14 * (1.0 + abs(run.t)) else DONE


@kernel
def adapt(run, tab, h, clipped, error):
    """Set the next step from the error of an accepted one."""
    # Slow growth: the friction is steep near rest, and a long step into it is lost.
    grow = 2.0 if error < 1e-3 else min(2.0, 0.8 * error ** (-1.0 / tab.order))
    new = h * max(grow, 0.3)
    # A step cut short by a sample or a jump says nothing against longer ones.
    run.h = max(new, run.h) if clipped and grow >= 1.0 else new
