"""Compiled change of the modes of a rig with effects and of the branches of their switches."""

from drill_env._jit import kernel, unit
from drill_env.integrator.modes import REVERSAL, SLIP, STICK, SWITCH, start_clamp
from drill_env.integrator.records import FIRST_SWITCH, LOWER, SPARE, UPPER
from drill_env.integrator.signatures import CHANGE, call_rates


@kernel
def rates_now(p, run, work, tab, u):
    """Event functions and rates of the present state, in the spare row."""
    for i in range(4):
        work.ys[SPARE, i] = run.y[i]
    for r in range(work.inner):
        work.zs[SPARE, r] = run.z[r]
    call_rates(tab.rates, p, run, work, SPARE, run.t, u)


@unit(CHANGE)
def change_with_effects(p, run, work, tab, which, u):
    """Pass an event other than the clamped law's; returns its kind."""
    rates_now(p, run, work, tab, u)
    if which >= FIRST_SWITCH:
        run.branch[which - FIRST_SWITCH] = work.next[which - FIRST_SWITCH]
        work.signal.settle = 1
        rates_now(p, run, work, tab, u)
        work.signal.settle = 0
        for r in range(work.inner):
            run.z[r] = work.zs[SPARE, r]
        return SWITCH
    before = run.mode[which]
    if before == 0:
        run.mode[which] = run.push[which]
        return SLIP
    run.y[1 + which] = 0.0
    run.mode[which] = 0
    run.since[which] = run.origin + run.t
    if which == LOWER:
        run.mode[2] = 0
    rates_now(p, run, work, tab, u)
    if work.gaps[SPARE, which] >= 0.0:
        return STICK
    run.mode[which] = run.push[which]
    return SLIP if run.mode[which] == before else REVERSAL


@unit(CHANGE)
def start_with_effects(p, run, work, tab, which, u):
    """Branches of a state, and its modes and first inner states where `which` asks for them.

    `which` is the sum of 1 for the modes and 2 for the inner states.
    """
    s = work.signal
    s.choose, s.first = 1, which // 2
    if run.push[UPPER] == 0:
        run.push[UPPER] = run.push[LOWER] = 1
        run.since[UPPER] = run.since[LOWER] = run.origin + run.t
    for attempt in range(2):
        if which % 2 == 1:
            choose_modes(p, run, work, attempt)
        rates_now(p, run, work, tab, u)
    for r in range(work.inner):
        run.z[r] = work.zs[SPARE, r]
    s.choose = s.first = 0
    work.has_rates = 0
    return STICK


@kernel
def choose_modes(p, run, work, attempt):
    """Directions of both discs; at the second attempt those at rest are held or released."""
    for disc in range(2):
        speed = run.y[1 + disc]
        if attempt == 0:
            run.mode[disc] = 1 if speed > 0.0 else (-1 if speed < 0.0 else 0)
        elif speed == 0.0 and work.gaps[SPARE, disc] < 0.0:
            run.mode[disc] = run.push[disc]
    start_clamp(p, run)
