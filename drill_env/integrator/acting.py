"""Compiled equations of motion (4) of a rig with effects, inside the event-driven integrator.

The effects stand in the right-hand side: they add to the ports of the two equations and have
states of their own. Corners and jumps are switches; each holds its branch within a step and ends
it as a disc's stick or slip does.
"""

from drill_env._jit import inlined, kernel, unit
from drill_env.dynamics.kernels import ROUNDING
from drill_env.effects.pace import fastest_rate
from drill_env.effects.signal import clear_ports, entry_at, respond
from drill_env.friction.kernels import lower_size, lower_sliding, upper_sliding
from drill_env.integrator._resting import choose_push, keep_held, keep_side, settle_sides
from drill_env.integrator._step import dense_at
from drill_env.integrator._voltage_piece import past_voltage_at, voltage_at, voltage_slope
from drill_env.integrator.records import FIRST_SWITCH, LOWER, N_STATE, SPARE, THETA_L, UPPER
from drill_env.integrator.signatures import GAP, RATES, STAGE, call_rates


@inlined
def set_sides(p, run, s):
    """Directions of the discs, of one at rest that in which it is judged, and the upper law."""
    s.side_u = run.push[0] if s.rest_u else run.mode[0]
    s.side_l = run.push[1] if s.rest_l else run.mode[1]
    s.friction_u = s.side_u * upper_sliding(p, s.side_u, s.side_u * s.speed_u)


@inlined
def set_state(p, run, s, y):
    """What the effects read in a state; the clock and the voltage there have been set."""
    s.twist, s.omega_u, s.omega_l, s.theta_l = y[0], y[1], y[2], y[3]
    s.theta_u = y[0] + y[3]
    s.rest_u, s.rest_l = run.mode[0] == 0, run.mode[1] == 0
    s.speed_u, s.speed_l = run.mode[0] * y[1], run.mode[1] * y[2]
    s.dwell_l = s.t - run.since[1] if s.rest_l else 0.0
    s.pull = p.ktheta * y[0]
    set_sides(p, run, s)


@inlined
def ask_one(p, run, work, e, s, out, y, k, gaps):
    """Let an effect add to the ports, and tell the rates of its inner states and its switches."""
    first = N_STATE + e.first_state
    for j in range(e.states):
        e.z[j] = 0.0 if s.first else y[first + j]
    for j in range(e.switches):
        e.side[j], e.gap[j] = run.branch[e.first_switch + j], 1.0
    respond(e.code, p, e, s, out)
    for j in range(e.states):
        k[first + j] = e.rate[j]
        if s.first or s.settle:
            y[first + j] = e.z[j]
    for j in range(e.switches):
        gaps[FIRST_SWITCH + e.first_switch + j] = e.gap[j]
        work.next[e.first_switch + j] = e.next[j]
        run.branch[e.first_switch + j] = e.side[j]


@inlined
def pulls(p, s, out, law):
    """Torques (Nm) on both discs without their friction, and the sizes of that."""
    string = s.pull + out.string
    net_u = out.drive * p.km * (s.u + out.volts) + p.load_u + out.torque_u - string
    net_l = string + p.load_l + out.torque_l
    size_u = s.friction_u * (1.0 + out.scale_u) + out.size_u
    size_l = law * (1.0 + out.scale_l) + out.size_l
    return net_u, net_l, size_u, size_l


@inlined
def set_rates(p, run, s, out, torques, k, gaps):
    """Rates of the state, and event functions of the discs that move."""
    mode = run.mode
    net_u, net_l, size_u, size_l = torques
    k[0], k[3] = s.omega_u - s.omega_l, s.omega_l
    k[1] = k[2] = 0.0
    if mode[0] != 0:
        k[1] = (net_u - mode[0] * size_u) / (p.Ju + out.inertia_u)
        gaps[0] = mode[0] * s.omega_u
    if mode[1] != 0:
        k[2] = (net_l - mode[1] * size_l) * p.per_Jl
        gaps[1] = mode[1] * s.omega_l
    elif p.locked:
        gaps[1] = 1.0


@inlined
def set_signal(p, run, work, row, t, u):
    """What the effects read in the state of a row."""
    s = work.signal
    s.t, s.u, s.u_rate = run.origin + t, u, voltage_slope(work, t)
    set_state(p, run, s, work.ys[row])
    if work.own_law:
        s.friction_l = lower_law(p, run, s.speed_l)


@inlined
def lower_law(p, run, speed):
    """Size (Nm) of the lower disc's own friction."""
    if run.mode[2] == 1:
        return 0.0
    # What the law gives at rest, without its exponentials.
    return p.Tsl if speed == 0.0 else lower_sliding(p, speed)


@inlined
def law_read(p, run, work):
    """The same at the speed at which the effects have it read."""
    s, out = work.signal, work.ports
    if out.read_l != s.speed_l:
        # Its clamping no event tells.
        return lower_size(p, out.read_l)
    return s.friction_l if work.own_law else lower_law(p, run, s.speed_l)


@inlined
def ask(p, run, work, row, t):
    """Let every effect add to the ports."""
    clear_ports(work.ports, work.signal)
    for i in range(work.acting):
        e = entry_at(work.effects, i)
        if e.idle:
            continue
        if e.delayed:
            e.u_late = past_voltage_at(work, t)
        y, k, gaps = work.ys[row], work.k[row], work.gaps[row]
        ask_one(p, run, work, e, work.signal, work.ports, y, k, gaps)


@unit(RATES)
def rates_with_effects(p, run, work, row, t, u):
    """Rates of the state and the inner states of a row, and all event functions there.

    A disc at rest is judged on both sides, and left on that to which it would leave. Effects that
    do not tell the sides apart are asked once for both.
    """
    mode, push, gaps = run.mode, run.push, work.gaps[row]
    rests = mode[0] == 0 or mode[1] == 0
    torques, held_u, held_l = (0.0, 0.0, 0.0, 0.0), 0.0, 0.0
    for attempt in range(3):
        if rests and attempt < 2:
            push[0] = push[1] = 2 * attempt - 1
        if attempt == 0 or work.sided:
            set_signal(p, run, work, row, t, u)
            ask(p, run, work, row, t)
        else:
            set_sides(p, run, work.signal)
        torques = pulls(p, work.signal, work.ports, law_read(p, run, work))
        if not rests or attempt == 2:
            break
        # As in `upper_margin`: what just holds does so whichever way its sum is rounded.
        net_u, net_l, size_u, size_l = torques
        terms = abs(p.km * u) + abs(work.signal.pull)
        keep_held(work, UPPER, attempt, size_u, push[0] * net_u - ROUNDING * (size_u + terms))
        keep_held(work, LOWER, attempt, size_l, push[1] * net_l)
        if work.sided:
            keep_side(work, row, attempt)
        if attempt == 1:
            held_u, held_l = choose_push(run, work, UPPER), choose_push(run, work, LOWER)
            if (mode[0] != 0 or push[0] == 1) and (mode[1] != 0 or push[1] == 1):
                break
            if not work.sided:
                break
    if rests and work.sided:
        settle_sides(run, work, row)
    work.net[0], work.net[1], work.asked = torques[0], torques[1], row
    gaps[0], gaps[1] = held_u, held_l
    set_rates(p, run, work.signal, work.ports, torques, work.k[row], gaps)


@unit(STAGE)
def stage_with_effects(p, run, work, tab, h, i, u):
    """Stage `i` of a step: what the unrolled pair leaves out, and its rates."""
    for r in range(THETA_L, N_STATE + work.inner):
        rise = 0.0
        for j in range(i):
            rise += tab.a[i, j] * work.k[j, r]
        work.ys[i, r] = work.ys[0, r] + h * rise
    call_rates(tab.rates, p, run, work, i, run.t + tab.c[i] * h, u)
    if i == 0 or i == tab.stages:
        work.pace[min(i, 1)] = fastest_of_all(p, work)
        if i == 0:
            work.pace[2] = 0.0


@kernel
def fastest_of_all(p, work):
    """Fastest rate (1/s) at which an inner state relaxes in the signal at hand.

    Of the effects in which the motion sets it: the others hold `max_step`.
    """
    fastest = 0.0
    for i in range(work.acting):
        e = entry_at(work.effects, i)
        if e.paced:
            fastest = max(fastest, fastest_rate(p, e, work.signal, work.ports, work.z_slopes))
    return fastest


@unit(GAP)
def gap_with_effects(p, run, work, tab, h, share, which):
    """Event function `which` at a share of the step, from the dense output."""
    for r in range(N_STATE + work.inner):
        work.ys[SPARE, r] = dense_at(work, tab, r, share)
    for disc in range(2):
        if run.mode[disc] == 0:
            work.ys[SPARE, 1 + disc] = 0.0
    t = run.t + share * h
    call_rates(tab.rates, p, run, work, SPARE, t, voltage_at(work, t))
    return work.gaps[SPARE, which]
