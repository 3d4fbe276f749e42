"""Powers, rates and what holds the discs, from the state of a motion alone.

Every switch of an effect is put where its function says, whatever the integrator held it at, and no
acceleration is asked for.
"""

from numba import njit

from drill_env.effects.signal import respond
from drill_env.friction.kernels import lower_sliding

# A motor this slow rests, and a voltage this near (V) has arrived.
_SLOW, _NEAR = 1e-9, 1e-7


@njit(cache=True)
def _law(p, speed):
    torque = lower_sliding(p, speed)
    return max(torque, 0.0) if p.clamp else torque


@njit(cache=True)
def _ask(p, entries, s, out, inner, late, slew, fresh):
    """Ports of all effects at the signal, every switch put anew or left where it is."""
    out.volts = out.torque_u = out.torque_l = out.string = out.size_u = out.size_l = 0.0
    out.scale_u = out.scale_l = out.inertia_u = out.angle_u = out.angle_l = 0.0
    out.drive, out.read_l, s.choose, s.first = 1.0, s.speed_l, int(fresh), 0
    for i in range(entries.size):
        e = entries[i]
        for j in range(e.states):
            e.z[j] = inner[e.first_state + j]
        if fresh:
            _reset(e, s, slew)
        e.u_late = late
        respond(e.code, p, e, s, out)


@njit(cache=True)
def _reset(e, s, slew):
    for j in range(e.switches):
        e.side[j] = 0
    if e.drives:
        e.side[0] = 0 if abs(e.z[1]) < _SLOW else (1 if e.z[1] > 0.0 else -1)
    if e.code == slew:
        # It would take the last stretch for arrived.
        gap = s.u - e.z[0]
        e.side[0] = 0 if abs(gap) < _NEAR else (1 if gap > 0.0 else -1)


@njit(cache=True)
def _stand(p, s, state, modes, push_u, push_l):
    """Signal of a state whose discs at rest are asked in a direction."""
    s.twist, s.omega_u, s.omega_l, s.theta_l = state[0], state[1], state[2], state[3]
    s.theta_u, s.pull = state[3] + state[0], p.ktheta * state[0]
    s.rest_u, s.rest_l = modes[0] == 0, modes[1] == 0
    s.side_u = push_u if s.rest_u else float(modes[0])
    s.side_l = push_l if s.rest_l else float(modes[1])
    s.speed_u = 0.0 if s.rest_u else s.side_u * s.omega_u
    s.speed_l = 0.0 if s.rest_l else s.side_l * s.omega_l
    s.friction_u = p.Tsu + s.side_u * p.dTsu + (p.bu + s.side_u * p.dbu) * s.speed_u
    s.friction_l = _law(p, s.speed_l)


@njit(cache=True)
def _sizes(p, s, out):
    """Torque of the motor on the disc, and sizes of both frictions."""
    motor = out.drive * p.km * (s.u + out.volts) + out.torque_u
    size_u = s.friction_u * (1.0 + out.scale_u) + out.size_u
    return motor, size_u, _law(p, out.read_l) * (1.0 + out.scale_l) + out.size_l


@njit(cache=True)
def _excess(held, scale):
    """By how much a disc at rest is driven away; to both sides, it may rest where nothing pulls."""
    driven = -min(held[0], held[1]) / scale
    return 0.0 if max(held[0], held[1]) < 0.0 else driven


@njit(cache=True)
def _ahead(held):
    """Share with which a disc at rest leans ahead, 0 or 1 where it leaves."""
    if min(held[0], held[1]) < 0.0 or held[0] + held[1] == 0.0:
        return 1.0 if held[1] <= held[0] else 0.0
    return held[0] / (held[0] + held[1])


@njit(cache=True)
def look_along(p, entries, s, out, t, u, states, modes, inner, dwell, slew, held, found, rates):
    """Rows of `found`: power, its parts' sizes, excess over stiction and added inertia."""
    for k in range(t.size):
        s.t, s.u, s.u_rate, s.dwell_l = t[k], u[k, 0], u[k, 1], dwell[k]
        for side in range(2):
            push = 2.0 * side - 1.0
            _stand(p, s, states[k], modes[k], push, push)
            _ask(p, entries, s, out, inner[k], u[k, 2], slew, True)
            motor, size_u, size_l = _sizes(p, s, out)
            held[0, side] = size_u - s.side_u * (motor - s.pull - out.string)
            held[1, side] = size_l - s.side_l * (s.pull + out.string + out.torque_l)
        push_u = -1.0 if held[0, 0] < held[0, 1] else 1.0
        push_l = -1.0 if held[1, 0] < held[1, 1] else 1.0
        _stand(p, s, states[k], modes[k], push_u, push_l)
        _ask(p, entries, s, out, inner[k], u[k, 2], slew, True)
        motor, size_u, size_l = _sizes(p, s, out)
        lost_u, lost_l = s.speed_u * size_u, s.speed_l * size_l
        v, w = s.omega_u, s.omega_l
        given = motor * v + out.torque_l * w - out.string * (v - w)
        found[k, 0] = given - lost_u - lost_l
        found[k, 1] = abs(motor * v) + abs(out.torque_l * w) + abs(out.string * (v - w))
        found[k, 1] += abs(lost_u) + abs(lost_l)
        found[k, 2] = 0.0
        if s.rest_u:
            found[k, 2] = _excess(held[0], 1.0 + abs(motor) + abs(s.pull))
        if s.rest_l:
            found[k, 2] = max(found[k, 2], _excess(held[1], 1.0 + abs(s.pull)))
        found[k, 3] = out.inertia_u
        _keep_rates(p, entries, s, out, states[k], modes[k], inner[k], u[k, 2], held, rates[k])


@njit(cache=True)
def _keep_rates(p, entries, s, out, state, modes, inner, late, held, rates):
    """Rates of the inner states: between those of both sides where their disc rests."""
    for side in range(2):
        push = 2.0 * side - 1.0
        _stand(p, s, state, modes, push, push)
        _ask(p, entries, s, out, inner, late, 0, False)
        for i in range(entries.size):
            e = entries[i]
            share = _ahead(held[0 if e.upper else 1]) if side == 1 else 1.0
            for j in range(e.states):
                rates[e.first_state + j] += share * (e.rate[j] - rates[e.first_state + j])
            if side == 1 and e.drives and abs(inner[e.first_state + 1]) < _SLOW:
                # One side alone may push it off; what both together turn back friction holds.
                if e.side[0] * rates[e.first_state + 1] < 0.0:
                    rates[e.first_state + 1] = 0.0
