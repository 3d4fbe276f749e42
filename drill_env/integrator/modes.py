"""Compiled slip/stick transitions: which mode follows which."""

from drill_env._jit import entry, inlined, kernel, placed
from drill_env.dynamics.kernels import lower_margin, lower_rate, upper_margin, upper_rate
from drill_env.integrator._events import CLOSED
from drill_env.integrator._step import dense_at
from drill_env.integrator.records import EVENT, FIRST_SWITCH, LOWER, LOWER_LAW, N_STATE, UPPER
from drill_env.integrator.signatures import call_change

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
    run.mode[2] = 0
    if p.clamp:
        speed = abs(run.y[2])
        run.mode[2] = 0 if speed <= p.clamp_low else (1 if speed <= p.clamp_high else 2)


@kernel
def transit(which, p, run, u):
    """Change the mode of disc `which` at its event; returns the kind of event."""
    if which == LOWER_LAW:
        rising = p.clamp_high - abs(run.y[2]) < abs(run.y[2]) - p.clamp_low
        run.mode[2] = 1 if run.mode[2] != 1 else (2 if rising else 0)
        return CLAMP
    margin, sign = margin_of(which, p, run, u)
    if run.mode[which] == 0:
        run.mode[which] = sign
        return SLIP
    run.y[1 + which] = 0.0
    if which == LOWER:
        run.mode[2] = 0
    if margin >= 0.0:
        run.mode[which] = 0
        return STICK
    if sign == run.mode[which]:
        return SLIP
    run.mode[which] = sign
    return REVERSAL


@inlined
def overdue(which, p, run, work, u):
    """Whether event `which` must happen right now, before any step."""
    if which > LOWER_LAW:
        return work.gaps[0, which] < -CLOSED
    direction = run.mode[which]
    if direction == 0 and work.acting != 0:
        return work.gaps[0, which] < 0.0
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
    first = work.k[0, 2]
    a, b = 0.0, 1.0
    for _ in range(60):
        s = 0.5 * (a + b)
        slope = 0.0
        for m in range(tab.degree - 1, -1, -1):
            slope = slope * s + (m + 1) * work.dense[2, m]
        if slope * first > 0.0:
            a = s
        else:
            b = s
    s = 0.5 * (a + b)
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
        note(work, run, run.t, which, kind, y)
        run.events += 1
        work.has_rates = 0
        return
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


@entry
def start_any(p, run, work, tab, code, wanted, u):
    """See `switching.start_with_effects`, whose address is `code`."""
    return call_change(code, p, run, work, tab, wanted, u)
