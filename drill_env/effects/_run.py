"""Compiled responses of an effect along a known motion."""

from drill_env._jit import entry, kernel
from drill_env.effects._signal import MEMORY, respond
from drill_env.friction._kernels import lower_sliding


@kernel
def set_torques(p, s):
    """Friction and net torques of the signal's speeds, twist and voltage."""
    speed = abs(s.omega_u)
    side = 1.0 if s.omega_u > 0.0 else (-1.0 if s.omega_u < 0.0 else 0.0)
    s.friction_u = p.Tsu + side * p.dTsu + (p.bu + side * p.dbu) * speed
    s.friction_l = lower_sliding(p, abs(s.omega_l))
    s.net_u = p.km * s.u - p.ktheta * s.twist
    s.net_l = p.ktheta * s.twist


@kernel
def forget(m):
    """Clear an effect's memory."""
    for i in range(MEMORY):
        m[i] = 0.0


@entry
def torques_along(code, p, q, m, s, out, t, u, motion, restarts, torques):
    """Mean torques that an effect gives over each held interval of a known motion.

    Args:
        code: of the effect.
        p: record of `PARAMETERS`.
        q: parameters of the effect.
        m: memory, shape (MEMORY,).
        s: record of `SIGNAL`.
        out: record of `RESPONSE`.
        t: times in s, shape (n,).
        u: held voltages in V, shape (n,).
        motion: twist, omega_u, omega_l, theta_l, alpha_u, alpha_l at the times, shape (n, 6).
        restarts: rows at which the memory is cleared, ascending, the first 0; shape (m,).
        torques: filled with the torques on the upper and lower disc, Nm, shape (n, 2).
    """
    window = 0
    for k in range(t.size - 1):
        s.first = 0
        if window < restarts.size and restarts[window] == k:
            window += 1
            forget(m)
            s.first = 1
        s.dt = t[k + 1] - t[k]
        s.t = 0.5 * (t[k] + t[k + 1])
        s.u = u[k]
        s.twist = 0.5 * (motion[k, 0] + motion[k + 1, 0])
        s.omega_u = 0.5 * (motion[k, 1] + motion[k + 1, 1])
        s.omega_l = 0.5 * (motion[k, 2] + motion[k + 1, 2])
        s.theta_l = 0.5 * (motion[k, 3] + motion[k + 1, 3])
        s.theta_u = s.theta_l + s.twist
        s.alpha_u = (motion[k + 1, 1] - motion[k, 1]) / s.dt
        s.alpha_l = (motion[k + 1, 2] - motion[k, 2]) / s.dt
        set_torques(p, s)
        out.torque_u = out.torque_l = 0.0
        respond(code, p, q, m, s, out)
        torques[k, 0], torques[k, 1] = out.torque_u, out.torque_l


@entry
def errors_along(code, p, q, m, s, out, t, u, motion, restarts, errors):
    """Errors that an effect gives to the encoders' readings along a known motion.

    Args as of `torques_along`; `errors` in rad, of theta_u and theta_l, shape (n, 2).
    """
    window = 0
    for k in range(t.size):
        s.first = 0
        if window < restarts.size and restarts[window] == k:
            window += 1
            forget(m)
            s.first = 1
        s.dt = t[k] - t[k - 1] if k > 0 else 0.0
        s.t, s.u = t[k], u[k]
        s.twist, s.omega_u, s.omega_l = motion[k, 0], motion[k, 1], motion[k, 2]
        s.theta_l = motion[k, 3]
        s.theta_u = s.theta_l + s.twist
        s.alpha_u, s.alpha_l = motion[k, 4], motion[k, 5]
        out.angle_u = out.angle_l = 0.0
        respond(code, p, q, m, s, out)
        errors[k, 0], errors[k, 1] = out.angle_u, out.angle_l
