"""Compiled slip/stick transitions: which mode, and which branch of a switch, follows which."""

from drill_env._intrinsics import placed
from drill_env._jit import entry, inlined, kernel, unit
from drill_env.dynamics.kernels import lower_margin, lower_rate, upper_margin, upper_rate
from drill_env.integrator._events import CLOSED
from drill_env.integrator._step import dense_at
from drill_env.integrator.records import (
    EVENT,
    FIRST_SWITCH,
    LOWER,
    LOWER_LAW,
    N_STATE,
    SPARE,
    UPPER,
)
from drill_env.integrator.signatures import CHANGE, call_change, call_rates

STICK, SLIP, REVERSAL, MAXIMUM, MINIMUM, CLAMP, SWITCH = 0, 1, 2, 3, 4, 5, 6

event_at = placed(EVENT)


@kernel
def margin_of(which, p, run, u):
    """Stiction left at a disc (Nm), and the sign it would leave in."""
    return upper_margin(p, run.y[0], u) if which == UPPER else lower_margin(p, run.y[0])


@entry
def start_mode(p, run, u):
    """Modes of a state that comes without any, from its velocities and torques."""
    if p.locked:
        run.y[2] = 0.0
    for which in range(2):
        omega = run.y[1 + which]
        margin, sign = margin_of(which, p, run, u)
        if omega == 0.0:
            run.mode[which] = 0 if margin >= 0.0 else sign
        else:
            run.mode[which] = 1 if omega > 0.0 else -1
    start_clamp(p, run)


@kernel
def start_clamp(p, run):
    """Range of the clamped law in which the lower disc's speed lies."""
    speed = abs(run.y[2])
    run.mode[2] = (speed > p.clamp_low) + (speed > p.clamp_high) if p.clamp else 0


@kernel
def stop(which, run):
    """Put a disc to rest at its event; returns the direction in which it moved, 0 for rest."""
    before = run.mode[which]
    run.y[1 + which], run.mode[which] = 0.0, 0
    if which == LOWER and before != 0:
        run.mode[2] = 0
    return before


@kernel
def go_on(which, run, before, held):
    """Leave it there where stiction holds it, or let it go in its direction; the event's kind."""
    if before != 0 and held >= 0.0:
        return STICK
    run.mode[which] = run.push[which]
    return SLIP if before in (0, run.push[which]) else REVERSAL


@kernel
def transit(which, p, run, u):
    """Change the mode of disc `which` at its event; returns the kind of event."""
    if which == LOWER_LAW:
        rising = p.clamp_high - abs(run.y[2]) < abs(run.y[2]) - p.clamp_low
        run.mode[2] = 1 if run.mode[2] != 1 else (2 if rising else 0)
        return CLAMP
    margin, run.push[which] = margin_of(which, p, run, u)
    return go_on(which, run, stop(which, run), margin)


@inlined
def overdue(which, p, run, work, u):
    """Whether event `which` must happen right now, before any step."""
    if which > LOWER_LAW:
        return work.gaps[0, which] < -CLOSED
    direction = run.mode[which]
    if direction == 0 and work.acting != 0:
        return work.gaps[0, which] < -CLOSED
    if direction == 0:
        return margin_of(which, p, run, u)[0] < 0.0
    speed = direction * run.y[1 + which]
    # Rounding leaves a released disc with a rate of about -1e-16: not a new contact.
    return speed < 0.0 or (speed == 0.0 and direction * work.k[0, 1 + which] < -1e-10)


@kernel
def note(work, run, t, which, kind, y):
    """Write one event down."""
    entry = event_at(work.log, run.logged)
    entry.t = t
    entry.disc = min(which, FIRST_SWITCH)
    entry.kind = kind
    for i in range(N_STATE):
        entry.y[i] = y[i]
    run.logged += 1


@kernel
def note_turn(run, work, tab, h):
    """Log the turning point of omega_l inside the step."""
    first, s, half = work.k[0, 2], 0.5, 0.25
    for _ in range(60):
        slope = 0.0
        for m in range(tab.degree - 1, -1, -1):
            slope = slope * s + (m + 1) * work.dense[2, m]
        s, half = s + half if slope * first > 0.0 else s - half, 0.5 * half
    for i in range(N_STATE):
        work.turn[i] = dense_at(work, tab, i, s)
    note(work, run, run.t + s * h, LOWER, MAXIMUM if first > 0.0 else MINIMUM, work.turn)


@kernel
def salt(work, row, factor):
    """Saltation at a zero crossing of one velocity.

    Only that velocity's rate jumps, so the saltation matrix scales its row by
    after/before; a stick sets it to zero. Break-aways and clamp switches leave the
    rates continuous: nothing to do there.
    """
    for c in range(work.columns):
        work.sens[row, c] *= factor


@kernel
def change(which, p, run, work, tab, u):
    """Pass event `which`: new mode, saltation, log entry."""
    y, mode = run.y, run.mode
    if work.acting != 0 and which != LOWER_LAW:
        if work.sensitivity:
            call_change(tab.mark, p, run, work, tab, which, u)
        kind = call_change(tab.change, p, run, work, tab, which, u)
        if work.sensitivity:
            call_change(tab.jump, p, run, work, tab, which, u)
    else:
        slipping = which != LOWER_LAW and mode[which] != 0
        before_u = upper_rate(p, mode[0], y[0], y[1], u)
        before_l = lower_rate(p, mode[1], mode[2], y[0], y[2])
        kind = transit(which, p, run, u)
        if work.sensitivity and slipping and which == UPPER:
            salt(work, 1, upper_rate(p, mode[0], y[0], y[1], u) / before_u)
        elif work.sensitivity and slipping:
            salt(work, 2, lower_rate(p, mode[1], mode[2], y[0], y[2]) / before_l)
    note(work, run, run.t, which, kind, y)
    run.events += 1
    work.has_rates = 0


@kernel
def rates_now(p, run, work, tab, u):
    """Event functions and rates of the present state, in the spare row."""
    for i in range(4):
        work.ys[SPARE, i] = run.y[i]
    for r in range(work.inner):
        work.ys[SPARE, N_STATE + r] = run.z[r]
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
            run.z[r] = work.ys[SPARE, N_STATE + r]
        return SWITCH
    before = stop(which, run)
    if before != 0:
        run.since[which] = run.origin + run.t
        rates_now(p, run, work, tab, u)
    return go_on(which, run, before, work.gaps[SPARE, which])


@unit(CHANGE)
def start_with_effects(p, run, work, tab, which, u):
    """Branches of a state, and its modes and first inner states where `which` asks for them.

    `which` is the sum of 1 for the modes and 2 for the inner states.
    """
    s = work.signal
    s.choose, s.first = 1 + which % 2, which // 2
    if run.push[UPPER] == 0:
        run.push[UPPER] = run.push[LOWER] = 1
        run.since[UPPER] = run.since[LOWER] = run.origin + run.t
    for attempt in range(2):
        if which % 2 == 1:
            choose_modes(p, run, work, attempt)
        rates_now(p, run, work, tab, u)
    for r in range(work.inner):
        run.z[r] = work.ys[SPARE, N_STATE + r]
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


@entry
def start_any(p, run, work, tab, code, wanted, u):
    """See `start_with_effects`, whose address is `code`."""
    return call_change(code, p, run, work, tab, wanted, u)
