"""Compiled errors of the encoders along samples of a motion."""

from drill_env._jit import entry, kernel
from drill_env.effects.signal import respond


@kernel
def errors_in(p, entries, s, out, inner, late):
    """Errors (rad) of both encoders at the signal `s`, which is filled, go to the ports.

    Args as of `errors_at`, of one sample.
    """
    out.angle_u = out.angle_l = 0.0
    s.choose, s.first = 1, 0
    for i in range(entries.size):
        e = entries[i]
        if e.senses:
            for j in range(e.states):
                e.z[j] = inner[e.first_state + j]
            e.theta_u_late, e.theta_l_late = late[i, 0], late[i, 1]
            respond(e.code, p, e, s, out)
    s.choose = 0


@entry
def errors_at(p, entries, s, out, t, states, inner, late, errors):
    """Errors of both encoders at samples.

    Args:
        p: record of `PARAMETERS`.
        entries: records of `ENTRY`.
        s: record of `SIGNAL`.
        out: record of `PORTS`.
        t: times in s, shape (n,).
        states: twist, omega_u, omega_l, theta_l there, shape (n, 4).
        inner: inner states of all effects, shape (n, inner).
        late: theta_u and theta_l of each effect's delay ago, rad, shape (n, effects, 2).
        errors: filled with the errors of theta_u and theta_l, rad, shape (n, 2).
    """
    for k in range(t.size):
        s.t = t[k]
        s.twist, s.omega_u, s.omega_l = states[k, 0], states[k, 1], states[k, 2]
        s.theta_l, s.theta_u = states[k, 3], states[k, 3] + states[k, 0]
        errors_in(p, entries, s, out, inner[k], late[k])
        errors[k, 0], errors[k, 1] = out.angle_u, out.angle_l
