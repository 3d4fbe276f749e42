"""Compiled torques and reading errors of an effect along a motion that is known.

Over an interval the motion is straight; the effect's inner states follow it, and its torque is the
mean over the interval.
"""

from drill_env._jit import entry, kernel
from drill_env.effects._along_interval import over_interval
from drill_env.effects._along_ports import ask, set_motion
from drill_env.effects.signal import RESTING


@kernel
def late_voltage(t, u, k, first, delay, before):
    """Mean of the held voltage a delay before the interval after row `k`, V."""
    begin, end = t[k] - delay, t[k + 1] - delay
    total, row = 0.0, k
    while end > begin:
        while row > first and t[row] >= end:
            row -= 1
        if t[row] >= end:
            return (total + before * (end - begin)) / (t[k + 1] - t[k])
        low = max(begin, t[row])
        total += u[row] * (end - low)
        end = low
    return total / (t[k + 1] - t[k])


@kernel
def angle_at(motion, row, column):
    """Angle (rad) in a row, of column 0 theta_u or 1 theta_l, and its speed (rad/s)."""
    if column == 0:
        return motion[row, 3] + motion[row, 0], motion[row, 1]
    return motion[row, 3], motion[row, 2]


@kernel
def late_angle(t, motion, k, first, delay, column):
    """Angle (rad) a delay before row `k`, of column 0 theta_u or 1 theta_l; cubic between rows."""
    wanted, row = t[k] - delay, k
    while row > first and t[row] > wanted:
        row -= 1
    theta, slope = angle_at(motion, row, column)
    if wanted <= t[row]:
        return theta
    dt = t[row + 1] - t[row]
    share = (wanted - t[row]) / dt
    far, far_slope = angle_at(motion, row + 1, column)
    a, b, gap = slope * dt, far_slope * dt, far - theta
    return theta + share * (a + share * (3.0 * gap - 2.0 * a - b + share * (a + b - 2.0 * gap)))


@kernel
def set_interval(motion, k, dt, begin, rate):
    """Straight motion from row `k` to the next one."""
    for i in range(4):
        begin[i] = motion[k, i]
        rate[i] = (motion[k + 1, i] - motion[k, i]) / dt


@kernel
def count_rest(s, motion, k, dt):
    """Time for which the lower disc has been at rest before the interval after row `k`."""
    if motion[k, 2] != 0.0 or motion[k + 1, 2] != 0.0:
        s.dwell_l = 0.0
        return 0.0
    return dt


@entry
def torques_along(p, e, s, out, t, u, motion, restarts, z, torques):
    """Mean torques that an effect gives over each held interval of a known motion.

    Args:
        p: record of `PARAMETERS`.
        e: record of `ENTRY`.
        s: record of `SIGNAL`.
        out: record of `PORTS`.
        t: times in s, shape (n,).
        u: held voltages in V, shape (n,).
        motion: twist, omega_u, omega_l, theta_l at the times in its first columns, shape (n, 6).
        restarts: rows at which the effect begins anew, ascending, the first 0; shape (m,).
        z: working array, shape (7, MOST_STATES); what lies in row 6 is its last inner states.
        torques: filled with the torques on the upper and lower disc, Nm, shape (n, 2).
    """
    window, first, before = 0, 0, 0.0
    for k in range(t.size - 1):
        if window < restarts.size and restarts[window] == k:
            window, first = window + 1, k
            s.first, s.dwell_l = 1, 0.0
            middle = 0.5 * (motion[k, 1] + motion[k + 1, 1])
            before = 0.0 if abs(middle) < RESTING else u[k]
        dt = t[k + 1] - t[k]
        set_interval(motion, k, dt, z[4], z[5])
        rested = count_rest(s, motion, k, dt)
        dwell = s.dwell_l
        if e.delayed:
            e.u_late = late_voltage(t, u, k, first, e.delay, before)
        over_interval(p, e, s, out, z[4], z[5], t[k], dt, u[k], z[6:], torques[k])
        s.dwell_l = dwell + rested


@entry
def errors_along(p, e, s, out, t, u, motion, restarts, z, errors):
    """Errors that an effect gives to the encoders' readings along a known motion.

    Args as of `torques_along`; `errors` in rad, of theta_u and theta_l, shape (n, 2).
    """
    window = first = 0
    for k in range(t.size):
        fresh = window < restarts.size and restarts[window] == k
        if fresh:
            window, first = window + 1, k
        elif e.states > 0:
            dt = t[k] - t[k - 1]
            set_interval(motion, k - 1, dt, z[4], z[5])
            z[0, 0] = z[0, 1] = 0.0
            over_interval(p, e, s, out, z[4], z[5], t[k - 1], dt, u[k - 1], z[6:], z[0])
        s.t = t[k]
        set_motion(p, s, motion[k, 0], motion[k, 1], motion[k, 2], motion[k, 3], u[k])
        s.first, s.choose = 1 if fresh else 0, 1
        if e.delayed:
            e.theta_u_late = late_angle(t, motion, k, first, e.delay, 0)
            e.theta_l_late = late_angle(t, motion, k, first, e.delay, 1)
        ask(p, e, s, out)
        s.first = s.choose = 0
        errors[k, 0], errors[k, 1] = out.angle_u, out.angle_l


@entry
def inner_along(p, entries, s, out, t, u, motion, restarts, z, rows, kept):
    """Inner states of all effects when a known motion comes to some rows.

    Args as of `torques_along`, and:
        entries: records of `ENTRY`.
        rows: ascending, shape (r,).
        kept: filled with the inner states there, shape (r, inner).
    """
    for i in range(entries.size):
        e = entries[i]
        if e.states == 0:
            continue
        window = place = 0
        for k in range(t.size):
            if window < restarts.size and restarts[window] == k:
                window += 1
                s.first, s.choose, s.dwell_l, s.t = 1, 1, 0.0, t[k]
                set_motion(p, s, motion[k, 0], motion[k, 1], motion[k, 2], motion[k, 3], u[k])
                ask(p, e, s, out)
                s.first = s.choose = 0
                if e.drives:
                    e.z[1] -= motion[k, 1]
            while place < rows.size and rows[place] == k:
                for j in range(e.states):
                    kept[place, e.first_state + j] = e.z[j]
                if e.drives:
                    kept[place, e.first_state + 1] += motion[k, 1]
                place += 1
            if place == rows.size or k + 1 == t.size:
                break
            dt = t[k + 1] - t[k]
            set_interval(motion, k, dt, z[4], z[5])
            over_interval(p, e, s, out, z[4], z[5], t[k], dt, u[k], z[6:], z[0])
