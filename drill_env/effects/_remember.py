"""Compiled memories of effects along a known motion."""

from drill_env._jit import entry, kernel
from drill_env.effects._bundle import add_errors, add_torques, forget_all


@kernel
def set_motion(s, motion, k, share):
    """Signal's motion at a share of the way from row `k` to the next one."""
    far = min(k + 1, motion.shape[0] - 1)
    near = 1.0 - share
    s.twist = near * motion[k, 0] + share * motion[far, 0]
    s.omega_u = near * motion[k, 1] + share * motion[far, 1]
    s.omega_l = near * motion[k, 2] + share * motion[far, 2]
    s.theta_l = near * motion[k, 3] + share * motion[far, 3]
    s.theta_u = s.theta_l + s.twist
    s.alpha_u = near * motion[k, 4] + share * motion[far, 4]
    s.alpha_l = near * motion[k, 5] + share * motion[far, 5]


@kernel
def keep(memories, kept, place):
    """Copy the memories of all effects."""
    for i in range(memories.shape[0]):
        for j in range(memories.shape[1]):
            kept[place, i, j] = memories[i, j]


@entry
def remember_along(p, bundle, memories, s, out, t, u, motion, restarts, counts, rows, kept):
    """Follow a known motion and keep what the effects remember when they come to some rows.

    Args:
        p: record of `PARAMETERS`.
        bundle: effects.
        memories: of the effects, shape (effects, MEMORY).
        s: record of `SIGNAL`.
        out: record of `RESPONSE`.
        t: times in s, shape (n,).
        u: held voltages in V, shape (n,).
        motion: twist, omega_u, omega_l, theta_l, alpha_u, alpha_l at the times, shape (n, 6).
        restarts: rows at which the memories are cleared, ascending, the first 0; shape (m,).
        counts: substeps of each interval, shape (n - 1,).
        rows: ascending, shape (r,).
        kept: filled with the memories before each of `rows` is read, shape (r, effects, MEMORY).
    """
    window = place = 0
    for k in range(rows[-1] + 1):
        s.first = 0
        if window < restarts.size and restarts[window] == k:
            window += 1
            forget_all(memories)
            s.first = 1
        if rows[place] == k:
            keep(memories, kept, place)
            place += 1
            if place == rows.size:
                return
        s.t, s.u = t[k], u[k]
        s.dt = 0.0 if s.first else t[k] - t[k - 1]
        set_motion(s, motion, k, 0.0)
        add_errors(p, bundle, memories, s, out)
        s.u = u[k]
        s.dt = (t[k + 1] - t[k]) / counts[k]
        for i in range(counts[k]):
            share = (i + 0.5) / counts[k]
            s.t = t[k] + share * (t[k + 1] - t[k])
            set_motion(s, motion, k, share)
            add_torques(p, bundle, memories, s, out)
            s.first = 0
