"""Errors of the encoders along samples of a motion."""

import numpy as np

from drill_env._jit import entry, kernel
from drill_env._types import FloatArray
from drill_env.effects.signal import PORTS, SIGNAL, respond


@kernel
def errors_in(p, entries, s, out, inner, late):
    """Errors (rad) of both encoders at the signal `s`, which is filled, go to the ports.

    Args as of `errors_of`, of one sample.
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
    """As `errors_of`, which go to `errors`."""
    for k in range(t.size):
        s.t = t[k]
        s.twist, s.omega_u, s.omega_l = states[k, 0], states[k, 1], states[k, 2]
        s.theta_l, s.theta_u = states[k, 3], states[k, 3] + states[k, 0]
        errors_in(p, entries, s, out, inner[k], late[k])
        errors[k, 0], errors[k, 1] = out.angle_u, out.angle_l


def errors_of(
    p: np.ndarray, entries: np.ndarray, t: FloatArray, states: FloatArray, inner: FloatArray,
    late: FloatArray,
) -> FloatArray:  # fmt: skip
    """Errors of both encoders at samples.

    Args:
        p: record of `PARAMETERS`, shape (1,).
        entries: records of `ENTRY`, shape (k,).
        t: times in s, shape (n,).
        states: twist, omega_u, omega_l, theta_l there in its first columns, shape (n, 4 or more).
        inner: inner states of all effects, shape (n, m).
        late: theta_u and theta_l of each effect's delay ago, rad, shape (n, k, 2).

    Returns:
        Errors of theta_u and theta_l, rad, shape (n, 2).
    """
    errors, signal, ports = np.zeros((len(t), 2)), np.zeros(1, SIGNAL)[0], np.zeros(1, PORTS)[0]
    late = np.ascontiguousarray(late)
    errors_at(p[0], entries, signal, ports, t, states, inner, late, errors)
    return errors
