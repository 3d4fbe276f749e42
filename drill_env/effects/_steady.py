"""Compiled torques of effects on discs that turn steadily."""

from drill_env._jit import entry
from drill_env.effects._bundle import add_torques


@entry
def torques_at(p, bundle, memories, s, out, u, states, torques):
    """Torques of effects without memory in given states.

    Args:
        p: record of `PARAMETERS`.
        bundle: effects.
        memories: of the effects, shape (effects, MEMORY).
        s: record of `SIGNAL`, its times, angles and accelerations 0.
        out: record of `RESPONSE`.
        u: voltages in V, shape (n,).
        states: twist, omega_u, omega_l, shape (n, 3).
        torques: filled with the torques on the upper and lower disc, Nm, shape (n, 2).
    """
    for k in range(u.size):
        s.u = u[k]
        s.twist, s.omega_u, s.omega_l = states[k, 0], states[k, 1], states[k, 2]
        add_torques(p, bundle, memories, s, out)
        torques[k, 0], torques[k, 1] = out.torque_u, out.torque_l
