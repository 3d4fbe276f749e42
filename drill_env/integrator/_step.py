"""Compiled start of a step, its error and its dense output.

The start of the step is stage 0 of `work.ys`; the state at its end stage `tab.stages`.
"""

from drill_env._jit import inlined, kernel
from drill_env.integrator._stage import keep_stage


@inlined
def fill_rates(p, run, work, tab, h, stage):
    """Rates of one stage from its state."""
    ys = work.ys
    keep_stage(p, run, work, tab, h, stage, (ys[stage, 0], ys[stage, 1], ys[stage, 2]))


@inlined
def dense_at(work, tab, component, s):
    """State component at share `s` of the step."""
    value = work.dense[component, tab.degree - 1]
    for m in range(tab.degree - 2, -1, -1):
        value = value * s + work.dense[component, m]
    return work.ys[0, component] + value * s


@inlined
def inner_at(work, tab, r, s):
    """Inner state `r` at share `s` of the step."""
    value = 0.0
    for m in range(tab.degree - 1, -1, -1):
        value = (value + work.dense_z[r, m]) * s
    return work.zs[0, r] + value


@kernel
def inner_dense(work, tab, h):
    """What `inner_at` reads, once the dense output of the state is filled."""
    for r in range(work.inner):
        for m in range(tab.degree):
            total = 0.0
            for j in range(tab.stages + tab.extra + 1):
                total += tab.dense[j, m] * work.kz[j, r]
            work.dense_z[r, m] = h * total


@inlined
def scaled(work, i, last):
    """Reciprocal of the error allowed in state component `i`."""
    size = max(abs(work.ys[0, i]), abs(work.ys[last, i]))
    return 1.0 / (work.atol + work.rtol * size)


@kernel
def inner_errors(work, tab):
    """Squared scaled errors of the inner states by both estimates, before the step's length."""
    n, high2, low2 = tab.stages, 0.0, 0.0
    for r in range(work.inner):
        high = low = 0.0
        for j in range(n + 1):
            high += tab.error_high[j] * work.kz[j, r]
            low += tab.error_low[j] * work.kz[j, r]
        size = max(abs(work.zs[0, r]), abs(work.zs[n, r]))
        scale = 1.0 / (work.atol + work.rtol * size)
        high2 += (high * scale) ** 2
        low2 += (low * scale) ** 2
    return high2, low2
