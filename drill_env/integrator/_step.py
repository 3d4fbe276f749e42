"""Compiled start of a step, its length, its error and its dense output.

The start of the step is stage 0 of `work.ys`; the state at its end stage `tab.stages`.
"""

from math import inf

from drill_env._jit import inlined, kernel, number_at
from drill_env.effects.pace import REACH
from drill_env.integrator._stage import keep_stage

DONE, LOG_FULL, STEP_TOO_SMALL, TOO_MANY_STEPS = 0, 1, 2, 3

# So many mode changes at one instant are chatter: one tiny step is then taken as it is.
CHATTER_LIMIT = 12
_CHATTER_STEP = 1e-7


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
        h = min(h, REACH / work.pace[0])
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
