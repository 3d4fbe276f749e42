"""Compiled search of the first mode change inside a step."""

from math import inf

from drill_env._jit import inlined, kernel
from drill_env.integrator._roots import CLOSED, asks_effects, dense_event, first_share, stage_event
from drill_env.integrator.records import LOWER, LOWER_LAW
from drill_env.integrator.signatures import call_fill, call_step

_SLOPE_SHARE = 1e-4


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
    switch or a release as near to zero as rounding, as where all comes to rest, does not close.
    """
    gaps = work.gaps
    low = high = gaps[0, which]
    for i in range(last + 1):
        if gaps[i, which] < -CLOSED:
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
def polish(which, p, run, work, tab, h, limit):
    """Step length at which the event function vanishes, by Newton on whole steps.

    Returns it, its error, and what the function is at its end, whose stages are left behind.
    """
    last, whole = tab.stages, limit
    judged = asks_effects(which, run, work)
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
                has_dense = True
            s = first_share(disc, p, run, work, tab, h)
            if s < share:
                share, which = s, disc
    if which < 0 or share == 0.0:
        return which, 0.0 if which >= 0 else h, 0.0
    h, error, value = polish(which, p, run, work, tab, share * h, h)
    moves = h > 1e-12 * (1.0 + abs(run.t))
    slips = work.acting != 0 and which < LOWER_LAW and run.mode[which] != 0
    shut = max(CLOSED, work.event_tol) if slips else CLOSED
    if (which > LOWER_LAW or slips) and moves and value > shut:
        # Only the dense output closes it, which errs by more than the step.
        return -1, h, error
    # What passes rest unseen, as a grip there may be, asks for a shorter step.
    return which, h, inf if slips and value < -shut else error
