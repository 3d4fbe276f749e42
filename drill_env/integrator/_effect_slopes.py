"""Compiled sensitivities of a rig with effects: variational equations and saltation.

Partial derivatives are complex steps of the equations of motion in the modes and branches of the
step (Squire and Trapp, SIAM Review 40, 1998): exact to rounding.
"""

from drill_env._intrinsics import placed, store_number
from drill_env._jit import kernel, unit
from drill_env.effects.signal import ENTRY_SLOPES, clear_ports
from drill_env.friction.kernels import gradient_of, shares, sliding_of, slope_of
from drill_env.integrator._voltage_piece import voltage_at, voltage_slope
from drill_env.integrator.acting import ask_one, pulls, set_rates, set_state
from drill_env.integrator.modes import rates_now
from drill_env.integrator.records import FIRST_SWITCH, LOWER, N_STATE, SPARE
from drill_env.integrator.signatures import CHANGE, FILL
from drill_env.integrator.slopes import SLOPES
from drill_env.parameters.record import N_PARAMETERS

slopes_at = placed(SLOPES)
entry_at = placed(ENTRY_SLOPES)

_STEP = 1e-40j
_SMALL = 1e-40
_TIME = -1


@kernel
def set_step(work, c, column):
    """Give the number that a column is of its step, and all others none."""
    for j in range(N_PARAMETERS):
        store_number(c.parameters, 2 * j + 1, _SMALL if N_STATE + j == column else 0.0)
    c.p.per_Ju, c.p.per_Jl = 1.0 / c.p.Ju, 1.0 / c.p.Jl
    for i in range(work.acting):
        e = entry_at(c.entries, i)
        for j in range(e.q.size):
            e.q[j] = e.q[j].real
        if column >= 0 and c.effect[column] == i:
            e.q[c.number[column]] += _STEP


@kernel
def law_slope(p, run, c, column, speed):
    """Size (Nm) of the lower disc's own friction, from the law's known derivatives."""
    own = speed.real == c.signal.speed_l.real
    if own and run.mode[2] == 1:
        return 0.0 * speed
    s1, s2 = shares(p, speed.real)
    gradient_of(p, speed.real, s1, s2, c.gradient)
    slope = slope_of(p, s1, s2) * speed.imag
    j = column - N_STATE
    if 8 <= j < N_PARAMETERS:
        slope += c.gradient[j] * _SMALL
    torque = sliding_of(p, speed.real, s1, s2)
    if p.clamp and torque < 0.0 and not own:
        return 0.0 * speed
    return torque + 1j * slope


@kernel
def column_rates(p, run, work, c, row, column, t, moves):
    """Rates and event functions in a row, with their derivative along `c.along`.

    `column` says which number has been given its step besides, `_TIME` none; `moves` is the step of
    the time.
    """
    s, out = c.signal, c.ports
    for r in range(N_STATE + work.inner):
        c.y[r] = work.ys[row, r] + _STEP * c.along[r]
    slope = voltage_slope(work, t)
    s.t = run.origin + t + _STEP * moves
    s.u, s.u_rate = voltage_at(work, t) + _STEP * slope * moves, slope
    set_state(c.p, run, s, c.y)
    if s.rest_l and column >= 0:
        s.dwell_l -= _STEP * c.since[column]
    s.friction_l = law_slope(p, run, c, column, s.speed_l)
    clear_ports(out, s)
    for i in range(work.acting):
        e = entry_at(c.entries, i)
        if not e.idle:
            ask_one(c.p, run, work, e, s, out, c.y, c.k, c.gaps)
    torques = pulls(c.p, s, out, law_slope(p, run, c, column, out.read_l))
    net_u, net_l, size_u, size_l = torques
    c.gaps[0], c.gaps[1] = size_u - s.side_u * net_u, size_l - s.side_l * net_l
    set_rates(c.p, run, s, out, torques, c.k, c.gaps)


@unit(FILL)
def carry_with_effects(p, run, work, tab, h):
    """Carry the sensitivities over the accepted step of `h` s whose stages are in `work`."""
    c = slopes_at(work.variation, 0)
    rows = N_STATE + work.inner
    for column in range(c.columns):
        c.moment[column] = 0.0
        set_step(work, c, column)
        for i in range(tab.stages + 1):
            for r in range(rows):
                rise = 0.0
                for j in range(i):
                    rise += tab.a[i, j] * c.rates[j, r, column]
                c.along[r] = c.sens[r, column] + h * rise
            if i < tab.stages:
                column_rates(p, run, work, c, i, column, run.t + tab.c[i] * h, 0.0)
                for r in range(rows):
                    c.rates[i, r, column] = c.k[r].imag / _SMALL
        for r in range(rows):
            c.sens[r, column] = c.along[r]


@kernel
def keep_rates(work, to):
    """Rates of the spare row."""
    for r in range(N_STATE + work.inner):
        to[r] = work.k[SPARE, r]


@unit(CHANGE)
def mark_event(p, run, work, tab, which, u):
    """Before a mode changes: rates, and how the moment of the event depends on every column.

    A change that follows another one at once, or a jump of the voltage, has its moment.
    """
    c = slopes_at(work.variation, 0)
    rates_now(p, run, work, tab, u)
    keep_rates(work, c.before)
    if work.located:
        for r in range(N_STATE + work.inner):
            c.along[r] = c.before[r]
        set_step(work, c, _TIME)
        column_rates(p, run, work, c, SPARE, _TIME, run.t, 1.0)
        fall = c.gaps[which].imag / _SMALL
        for column in range(c.columns):
            for r in range(N_STATE + work.inner):
                c.along[r] = c.sens[r, column]
            set_step(work, c, column)
            column_rates(p, run, work, c, SPARE, column, run.t, 0.0)
            change = c.gaps[which].imag / _SMALL
            c.moment[column] = -change / fall if fall != 0.0 else 0.0
    c.stopped = 1 if which < FIRST_SWITCH and run.mode[which] != 0 else 0
    return 0


@unit(CHANGE)
def jump_after_event(p, run, work, tab, which, u):
    """Saltation: what the change has moved, and the rates that jumped, over the event's moment."""
    c = slopes_at(work.variation, 0)
    rows = N_STATE + work.inner
    rates_now(p, run, work, tab, u)
    keep_rates(work, c.after)
    for column in range(c.columns):
        moment = c.moment[column]
        for r in range(rows):
            c.along[r] = c.sens[r, column] + c.before[r] * moment
        if which < FIRST_SWITCH and c.stopped:
            c.along[1 + which] = 0.0
            if which == LOWER:
                c.since[column] = moment
        if which >= FIRST_SWITCH and work.inner > 0:
            c.signal.settle = 1
            set_step(work, c, column)
            column_rates(p, run, work, c, SPARE, column, run.t, moment)
            c.signal.settle = 0
            for r in range(N_STATE, rows):
                c.along[r] = c.y[r].imag / _SMALL
        for r in range(rows):
            c.sens[r, column] = c.along[r] - c.after[r] * moment
    return 0


@unit(CHANGE)
def first_slopes(p, run, work, tab, which, u):
    """Sensitivities of the first inner states, and none of a disc at rest by its speed."""
    c = slopes_at(work.variation, 0)
    for disc in range(2):
        if run.mode[disc] == 0:
            c.sens[1 + disc, 1 + disc] = 0.0
    rates_now(p, run, work, tab, u)
    if which == 0:
        return 0
    c.signal.choose = c.signal.first = 1
    for column in range(c.width):
        for r in range(N_STATE + work.inner):
            c.along[r] = c.sens[r, column] if r < N_STATE else 0.0
        set_step(work, c, column)
        column_rates(p, run, work, c, SPARE, column, run.t, 0.0)
        for r in range(N_STATE, N_STATE + work.inner):
            c.sens[r, column] = c.y[r].imag / _SMALL
    c.signal.choose = c.signal.first = 0
    return 0
