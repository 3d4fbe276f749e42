"""Compiled event functions over a step, event location and mode transitions."""

from drill_env._jit import kernel
from drill_env.dynamics._kernels import (
    clamp_event,
    lower_event,
    lower_margin,
    upper_event,
    upper_margin,
)
from drill_env.parameters._vector import CLAMP, LOCKED
from drill_env.integrator._step import dense_at, run_stages, voltage_at, voltage_slope

UPPER, LOWER, CLAMP_DISC = 0, 1, 2
STICK, SLIP, REVERSAL, MAXIMUM, MINIMUM, CLAMP_SWITCH = 0, 1, 2, 3, 4, 5

_SAMPLES = 16


@kernel
def event_function(which, p, mode, x0, x1, x2, rate_u, rate_l, u, du):
    """Event function of disc `which` and its time derivative."""
    if which == UPPER:
        return upper_event(p, mode[0], x0, x1, x2, rate_u, u, du)
    if which == LOWER:
        return lower_event(p, mode[1], x0, x1, x2, rate_l)
    return clamp_event(p, mode[1], mode[2], x2, rate_l)


@kernel
def stage_event(which, p, mode, ys, k, stage, u, du):
    """Event function at one stored stage."""
    return event_function(
        which, p, mode, ys[stage, 0], ys[stage, 1], ys[stage, 2], k[stage, 1], k[stage, 2], u, du
    )


@kernel
def dense_event(which, p, mode, y, dense, degree, piece, length, elapsed, h, s):
    """Event function at share `s` of the step, from the dense output."""
    if which != CLAMP_DISC and mode[which] != 0:
        return mode[which] * dense_at(y, dense, degree, 1 + which, s)
    x0 = dense_at(y, dense, degree, 0, s)
    x2 = dense_at(y, dense, degree, 2, s)
    u = voltage_at(piece, length, elapsed + s * h)
    return event_function(which, p, mode, x0, 0.0, x2, 0.0, 0.0, u, 0.0)[0]


@kernel
def slip_may_end(sign, row, ys, k, last):
    """Whether a velocity can reach zero inside the step; errs on the side of yes.

    The end value alone misses a graze, so a step that holds a minimum is looked into,
    unless the velocity stays within a factor two of its largest value.
    """
    low = high = sign * ys[last, row]
    for i in range(last):
        speed = sign * ys[i, row]
        low = min(low, speed)
        high = max(high, speed)
    if sign * ys[last, row] < 0.0 or low < 0.0 < sign * ys[0, row]:
        return True
    return low < 0.5 * high and sign * k[0, row] < 0.0 < sign * k[last, row]


@kernel
def margin_may_end(which, p, mode, ys, k, last, piece, length, elapsed, h):
    """Whether a margin (stiction or clamp) can be used up inside the step; rather yes."""
    u, du = voltage_at(piece, length, elapsed), voltage_slope(piece, length, elapsed)
    _, start_slope = stage_event(which, p, mode, ys, k, 0, u, du)
    u, du = voltage_at(piece, length, elapsed + h), voltage_slope(piece, length, elapsed + h)
    end, end_slope = stage_event(which, p, mode, ys, k, last, u, du)
    return end < 0.0 or start_slope < 0.0 < end_slope


@kernel
def may_end(which, p, mode, ys, k, last, piece, length, elapsed, h):
    """Whether disc `which` can change mode inside the step; errs on the side of yes."""
    if which == CLAMP_DISC:
        if p[CLAMP] == 0.0 or mode[1] == 0:
            return False
    elif mode[which] != 0:
        return slip_may_end(mode[which], 1 + which, ys, k, last)
    elif which == LOWER and p[LOCKED] != 0.0:
        return False
    return margin_may_end(which, p, mode, ys, k, last, piece, length, elapsed, h)


@kernel
def lowest_share(which, p, mode, y, dense, degree, piece, length, elapsed, h, left, right):
    """Share in [left, right] where the event function is smallest (golden section)."""
    ratio = 0.6180339887498949
    a, b = left, right
    c, d = b - ratio * (b - a), a + ratio * (b - a)
    fc = dense_event(which, p, mode, y, dense, degree, piece, length, elapsed, h, c)
    fd = dense_event(which, p, mode, y, dense, degree, piece, length, elapsed, h, d)
    for _ in range(40):
        if fc < fd:
            b, d, fd = d, c, fc
            c = b - ratio * (b - a)
            fc = dense_event(which, p, mode, y, dense, degree, piece, length, elapsed, h, c)
        else:
            a, c, fc = c, d, fd
            d = a + ratio * (b - a)
            fd = dense_event(which, p, mode, y, dense, degree, piece, length, elapsed, h, d)
        if fc < 0.0:
            return c
        if fd < 0.0:
            return d
    return 0.5 * (a + b)


@kernel
def root_share(which, p, mode, y, dense, degree, piece, length, elapsed, h, left, right):
    """First crossing in (left, right], positive on the left (Illinois, then bisection)."""
    a, b = left, right
    fa = dense_event(which, p, mode, y, dense, degree, piece, length, elapsed, h, a)
    fb = dense_event(which, p, mode, y, dense, degree, piece, length, elapsed, h, b)
    if fa <= 0.0:
        return a
    kept = 0
    for i in range(80):
        middle = (a * fb - b * fa) / (fb - fa) if i < 20 else 0.5 * (a + b)
        value = dense_event(which, p, mode, y, dense, degree, piece, length, elapsed, h, middle)
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
def first_share(which, p, mode, y, dense, degree, piece, length, elapsed, h):
    """Share of the step at which disc `which` first changes mode, 2 if it does not."""
    before = dense_event(which, p, mode, y, dense, degree, piece, length, elapsed, h, 0.0)
    here = dense_event(which, p, mode, y, dense, degree, piece, length, elapsed, h, 1.0 / _SAMPLES)
    if here < 0.0:
        if before <= 0.0:
            return 0.0
        return root_share(
            which, p, mode, y, dense, degree, piece, length, elapsed, h, 0.0, 1.0 / _SAMPLES
        )
    for i in range(2, _SAMPLES + 1):
        s = i / _SAMPLES
        after = dense_event(which, p, mode, y, dense, degree, piece, length, elapsed, h, s)
        left = s - 1.0 / _SAMPLES
        if here <= before and here <= after:
            lowest = lowest_share(
                which, p, mode, y, dense, degree, piece, length, elapsed, h,
                left - 1.0 / _SAMPLES, s,
            )  # fmt: skip
            value = dense_event(
                which, p, mode, y, dense, degree, piece, length, elapsed, h, lowest
            )
            if value < 0.0:
                start = left - 1.0 / _SAMPLES
                return root_share(
                    which, p, mode, y, dense, degree, piece, length, elapsed, h, start, lowest
                )
        if after < 0.0:
            return root_share(
                which, p, mode, y, dense, degree, piece, length, elapsed, h, left, s
            )
        before, here = here, after
    return 2.0


@kernel
def polish(which, p, mode, y, piece, length, elapsed, h, limit, tableau, k, ys):
    """Step length at which the event function vanishes, by Newton on whole steps.

    Leaves the stages of the step to the event in `k` and `ys`.
    """
    last = tableau.stages
    for _ in range(4):
        run_stages(p, mode, y, piece, length, elapsed, h, tableau, k, ys, 1, last)
        u, du = voltage_at(piece, length, elapsed + h), voltage_slope(piece, length, elapsed + h)
        value, slope = stage_event(which, p, mode, ys, k, last, u, du)
        # A graze has no slope to divide by; the dense root is then kept.
        if slope >= 0.0 or abs(value) <= 1e-16 or abs(value) > 0.1 * h * abs(slope):
            break
        new = min(h - value / slope, limit)
        if abs(new - h) <= 1e-15 * (elapsed + h):
            break
        h = new
    return h


@kernel
def start_mode(p, y, mode, u):
    """Modes of a state that comes without any, from its velocities and torques."""
    margin, sign = upper_margin(p, y[0], u)
    mode[0] = 1 if y[1] > 0.0 else (-1 if y[1] < 0.0 else (0 if margin >= 0.0 else sign))
    margin, sign = lower_margin(p, y[0])
    mode[1] = 1 if y[2] > 0.0 else (-1 if y[2] < 0.0 else (0 if margin >= 0.0 else sign))
    mode[2] = 0
    if clamp_event(p, mode[1], 0, y[2], 0.0)[0] < 0.0:
        mode[2] = 1


@kernel
def transit(which, p, y, mode, u):
    """Change the mode of disc `which` at its event; returns the kind of event."""
    if which == CLAMP_DISC:
        mode[2] = 1 - mode[2]
        return CLAMP_SWITCH
    margin, sign = upper_margin(p, y[0], u) if which == UPPER else lower_margin(p, y[0])
    if mode[which] == 0:
        mode[which] = sign
        return SLIP
    y[1 + which] = 0.0
    if which == LOWER:
        mode[2] = 0
    if margin >= 0.0:
        mode[which] = 0
        return STICK
    if sign == mode[which]:
        return SLIP
    mode[which] = sign
    return REVERSAL


@kernel
def overdue(which, p, y, mode, k, u):
    """Whether disc `which` must change mode right now, before any step."""
    if which == CLAMP_DISC:
        return False
    if mode[which] == 0:
        margin = upper_margin(p, y[0], u)[0] if which == UPPER else lower_margin(p, y[0])[0]
        return margin < 0.0
    speed = mode[which] * y[1 + which]
    rate = mode[which] * k[0, 1 + which]
    # Rounding leaves a released disc with a rate of about -1e-16: not a new contact.
    return speed < 0.0 or (speed == 0.0 and rate < -1e-10)
