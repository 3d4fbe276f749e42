"""Compiled event functions over a step, and the first share of it at which one is zero."""

from drill_env._jit import inlined, kernel
from drill_env.dynamics.kernels import clamp_event, lower_event, upper_event
from drill_env.integrator._step import dense_at
from drill_env.integrator._voltage_piece import voltage_at, voltage_slope
from drill_env.integrator.records import LOWER, LOWER_LAW, UPPER
from drill_env.integrator.signatures import call_gap

# What lies this little on the other side of a switch is there by rounding.
CLOSED = 1e-11
_SAMPLES = 16


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
