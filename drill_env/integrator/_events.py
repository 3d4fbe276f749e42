"""Compiled event functions over a step and the location of their first zero."""

from math import inf

from drill_env._jit import inlined, kernel
from drill_env.dynamics.kernels import clamp_event, lower_event, upper_event
from drill_env.integrator._step import dense_at, inner_dense
from drill_env.integrator._voltage_piece import voltage_at, voltage_slope
from drill_env.integrator.records import LOWER, LOWER_LAW, UPPER
from drill_env.integrator.signatures import call_fill, call_gap, call_step

# What lies this little on the other side of a switch is there by rounding.
CLOSED = 1e-11
_SAMPLES = 16
_SLOPE_SHARE = 1e-4


@kernel
def stage_event(which, p, run, work, stage, t):
    """Event function of disc `which` and its slope at one stored stage."""
    ys, k, mode = work.ys, work.k, run.mode
    if which == UPPER:
        u, du = voltage_at(work, t), voltage_slope(work, t)
        return upper_event(p, mode[0], ys[stage, 0], ys[stage, 1], ys[stage, 2], k[stage, 1], u, du)
    if which == LOWER:
        return lower_event(p, mode[1], ys[stage, 0], ys[stage, 1], ys[stage, 2], k[stage, 2])
    return clamp_event(p, mode[1], mode[2], ys[stage, 2], k[stage, 2])


@inlined
def asks_effects(which, run, work):
    """Whether effects decide on an event: a switch of theirs, or the release of a disc at rest."""
    if work.acting == 0 or which == LOWER_LAW:
        return False
    return which > LOWER_LAW or run.mode[which] == 0


@kernel
def dense_event(which, p, run, work, tab, h, s):
    """Event function `which` at share `s` of the step, from the dense output."""
    mode = run.mode
    if asks_effects(which, run, work):
        return call_gap(tab.gap, p, run, work, tab, h, s, which)
    if which != LOWER_LAW and mode[which] != 0:
        return mode[which] * dense_at(work, tab, 1 + which, s)
    if which == LOWER_LAW:
        return clamp_event(p, mode[1], mode[2], dense_at(work, tab, 2, s), 0.0)[0]
    twist = dense_at(work, tab, 0, s)
    if which == LOWER:
        return lower_event(p, 0, twist, 0.0, 0.0, 0.0)[0]
    return upper_event(p, 0, twist, 0.0, 0.0, 0.0, voltage_at(work, run.t + s * h), 0.0)[0]


@inlined
def slip_may_end(sign, row, work, last):
    """Whether a velocity can reach zero inside the step; errs on the side of yes.

    The end value alone misses a graze, so a step that holds a minimum is looked into,
    unless the velocity stays within a factor two of its largest value.
    """
    ys, k = work.ys, work.k
    low = high = sign * ys[last, row]
    for i in range(last):
        speed = sign * ys[i, row]
        low = min(low, speed)
        high = max(high, speed)
    if sign * ys[last, row] < 0.0 or low < 0.0 < sign * ys[0, row]:
        return True
    return low < 0.5 * high and sign * k[0, row] < 0.0 < sign * k[last, row]


@kernel
def gap_may_close(which, work, last):
    """Whether an event function of a rig with effects can be negative in the step.

    As for a velocity, one that falls at first and rises at last may have been so in between. A
    switch that is as near to zero as rounding, as where all comes to rest, does not close.
    """
    gaps = work.gaps
    shut = -CLOSED if which > LOWER_LAW else 0.0
    low = high = gaps[0, which]
    for i in range(last + 1):
        if gaps[i, which] < shut:
            return True
        low, high = min(low, gaps[i, which]), max(high, gaps[i, which])
    falls, rises = gaps[1, which] < gaps[0, which], gaps[last - 2, which] < gaps[last, which]
    return falls and rises and low < 0.5 * high and high > CLOSED


@inlined
def may_end(which, p, run, work, last, h):
    """Whether event `which` can happen inside the step; errs on the side of yes."""
    if asks_effects(which, run, work):
        return gap_may_close(which, work, last)
    if which == LOWER_LAW:
        if not p.clamp or run.mode[1] == 0:
            return False
    elif run.mode[which] != 0:
        return slip_may_end(run.mode[which], 1 + which, work, last)
    elif which == LOWER and p.locked:
        return False
    _, start_slope = stage_event(which, p, run, work, 0, run.t)
    end, end_slope = stage_event(which, p, run, work, last, run.t + h)
    return end < 0.0 or start_slope < 0.0 < end_slope


@kernel
def lowest_share(which, p, run, work, tab, h, left, right):
    """Share in [left, right] where the event function is smallest (golden section)."""
    ratio = 0.6180339887498949
    a, b = left, right
    c, d = b - ratio * (b - a), a + ratio * (b - a)
    fc = dense_event(which, p, run, work, tab, h, c)
    fd = dense_event(which, p, run, work, tab, h, d)
    for _ in range(40):
        if fc < 0.0:
            return c
        if fd < 0.0:
            return d
        if fc < fd:
            b, d, fd = d, c, fc
            c = b - ratio * (b - a)
            fc = dense_event(which, p, run, work, tab, h, c)
        else:
            a, c, fc = c, d, fd
            d = a + ratio * (b - a)
            fd = dense_event(which, p, run, work, tab, h, d)
    return 0.5 * (a + b)


@kernel
def root_share(which, p, run, work, tab, h, left, right):
    """Crossing in (left, right], positive on the left (Illinois, then bisection)."""
    a, b = left, right
    fa = dense_event(which, p, run, work, tab, h, a)
    fb = dense_event(which, p, run, work, tab, h, b)
    if fa <= 0.0:
        return a
    kept = 0
    for i in range(80):
        middle = (a * fb - b * fa) / (fb - fa) if i < 20 else 0.5 * (a + b)
        value = dense_event(which, p, run, work, tab, h, middle)
        if abs(value) < 1e-15 or b - a < 1e-14:
            return middle
        if value > 0.0:
            a, fa = middle, value
            fb, kept = (0.5 * fb, 1) if kept == 1 else (fb, 1)
        else:
            b, fb = middle, value
            fa, kept = (0.5 * fa, 2) if kept == 2 else (fa, 2)
    return 0.5 * (a + b)


@kernel
def share_of_return(which, p, run, work, tab, h, width):
    """Where a function that is zero at the start falls again before `width`, 0 if it never rose.

    That of a switch just passed, or the speed of a disc just released that a drive, far quicker
    than the step, turns round: the step is only a try. A disc that leaves by rounding alone has not
    risen.
    """
    least = 0.0 if which > LOWER_LAW else CLOSED
    left, right = 0.5 * width, width
    for _ in range(20):
        if dense_event(which, p, run, work, tab, h, left) > least:
            return root_share(which, p, run, work, tab, h, left, right)
        left, right = 0.5 * left, left
    return 0.0


@kernel
def first_share(which, p, run, work, tab, h):
    """Share of the step at which disc `which` first changes mode, 2 if it does not."""
    width = 1.0 / _SAMPLES
    before = dense_event(which, p, run, work, tab, h, 0.0)
    here = dense_event(which, p, run, work, tab, h, width)
    if here < 0.0 and before <= 0.0:
        return share_of_return(which, p, run, work, tab, h, width)
    if here < 0.0:
        return root_share(which, p, run, work, tab, h, 0.0, width)
    for i in range(2, _SAMPLES + 1):
        s = i * width
        after = dense_event(which, p, run, work, tab, h, s)
        if here <= before and here <= after:
            lowest = lowest_share(which, p, run, work, tab, h, s - 2.0 * width, s)
            if dense_event(which, p, run, work, tab, h, lowest) < 0.0:
                return root_share(which, p, run, work, tab, h, s - 2.0 * width, lowest)
        if after < 0.0:
            return root_share(which, p, run, work, tab, h, s - width, s)
        before, here = here, after
    return 2.0


@kernel
def polish(which, p, run, work, tab, h, limit):
    """Step length at which the event function vanishes, by Newton on whole steps.

    Returns it, its error, and what the function is at its end, whose stages are left behind.
    """
    last, whole = tab.stages, limit
    judged = work.acting != 0 and (
        which > LOWER_LAW or (which < LOWER_LAW and run.mode[which] == 0)
    )
    value = slope = error = 0.0
    if judged:
        # Only the effects know how the function rises; the slope need not be exact.
        near, far = h / whole, h / whole - _SLOPE_SHARE
        slope = dense_event(which, p, run, work, tab, whole, near)
        slope = (slope - dense_event(which, p, run, work, tab, whole, far)) / (_SLOPE_SHARE * whole)
    for attempt in range(4):
        error = call_step(tab.step, p, run, work, tab, h)
        if judged:
            value = work.gaps[last, which]
        else:
            value, slope = stage_event(which, p, run, work, last, run.t + h)
        # The stages must be those of the step that is returned.
        if attempt == 3:
            break
        # A graze has no slope to divide by; the dense root is then kept.
        if slope >= 0.0 or abs(value) <= work.event_tol or abs(value) > 0.1 * h * abs(slope):
            break
        new = min(h - value / slope, limit)
        if abs(new - h) <= 1e-15 * (1.0 + abs(run.t)):
            break
        h = new
    return h, error, value


@kernel
def first_event(p, run, work, tab, h):
    """Earliest mode change inside the step just taken: (disc or -1, step length to it, its error).

    The stages left behind are those of the step to the event. Its error may be the larger one: the
    longer try has leapt over what is narrow and close to the event.
    """
    share, which, has_dense = 2.0, -1, False
    for disc in range(3 + work.switches):
        if may_end(disc, p, run, work, tab.stages, h):
            if not has_dense:
                call_fill(tab.fill, p, run, work, tab, h)
                inner_dense(work, tab, h)
                has_dense = True
            s = first_share(disc, p, run, work, tab, h)
            if s < share:
                share, which = s, disc
    if which < 0:
        return which, h, 0.0
    if share == 0.0:
        return which, 0.0, 0.0
    h, error, value = polish(which, p, run, work, tab, share * h, h)
    moves = h > 1e-12 * (1.0 + abs(run.t))
    slips = work.acting != 0 and which < LOWER_LAW and run.mode[which] != 0
    if (which > LOWER_LAW or slips) and moves and value > CLOSED:
        # Only the dense output closes it, which errs by more than the step.
        return -1, h, error
    # What passes rest unseen, as a grip there may be, asks for a shorter step.
    return which, h, inf if slips and value < -CLOSED else error
