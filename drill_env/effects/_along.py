"""Compiled torques and inner states of an effect along a motion that is known.

Over an interval the motion is straight; the effect's inner states follow it, and its torque is the
mean over the interval.
"""

from drill_env._jit import entry, inlined, kernel
from drill_env.effects._along_interval import call_over_interval
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


@inlined
def set_interval(motion, k, dt, begin, rate):
    """Straight motion from row `k` to the next one."""
    share = 1.0 / dt
    for i in range(4):
        begin[i] = motion[k, i]
        rate[i] = (motion[k + 1, i] - motion[k, i]) * share


@inlined
def count_rest(s, motion, k, dt):
    """Time for which the lower disc has been at rest before the interval after row `k`."""
    if motion[k, 2] != 0.0 or motion[k + 1, 2] != 0.0:
        s.dwell_l = 0.0
        return 0.0
    return dt


@kernel
def begin_anew(p, e, s, out, t, motion, u):
    """First inner states of an effect, in a row of the motion."""
    s.first, s.choose, s.dwell_l, s.t = 1, 1, 0.0, t
    set_motion(p, s, motion[0], motion[1], motion[2], motion[3], u)
    for j in range(e.states):
        e.z[j] = 0.0
    ask(p, e, s, out)
    s.first = s.choose = 0
    if e.drives:
        e.z[1] -= motion[1]


@entry
def follow(p, e, s, out, over, t, u, motion, restarts, z, torques, rows, kept):
    """Mean torques that an effect gives over each held interval of a known motion.

    Args:
        p: record of `PARAMETERS`.
        e: record of `ENTRY`.
        s: record of `SIGNAL`.
        out: record of `PORTS`.
        over: address of `over_interval`.
        t: times in s, shape (n,).
        u: held voltages in V, shape (n,).
        motion: twist, omega_u, omega_l, theta_l at the times in its first columns, shape (n, 6).
        restarts: rows at which the effect begins anew, ascending, the first 0; shape (m,).
        z: working array, shape (11, MOST_STATES).
        torques: filled with the torques on the upper and lower disc, Nm, shape (n, 2).
        rows: ascending, shape (r,).
        kept: filled with the effect's inner states in these rows, shape (r, its states).
    """
    window, first, before, place = 0, 0, 0.0, 0
    begin, rate, rest = z[4], z[5], z[6:]
    for k in range(t.size):
        if window < restarts.size and restarts[window] == k:
            window, first = window + 1, k
            middle = 0.5 * (motion[k, 1] + motion[min(k + 1, t.size - 1), 1])
            before = e.u_late = 0.0 if abs(middle) < RESTING else u[k]
            begin_anew(p, e, s, out, t[k], motion[k], u[k])
        while place < rows.size and rows[place] == k:
            for j in range(e.states):
                kept[place, j] = e.z[j]
            if e.drives:
                kept[place, 1] += motion[k, 1]
            place += 1
        if k + 1 == t.size:
            break
        dt = t[k + 1] - t[k]
        set_interval(motion, k, dt, begin, rate)
        rested = count_rest(s, motion, k, dt)
        dwell = s.dwell_l
        if e.delayed:
            e.u_late = late_voltage(t, u, k, first, e.delay, before)
        mean = torques[k]
        call_over_interval(over, p, e, s, out, begin, rate, t[k], dt, u[k], rest, mean)
        s.dwell_l = dwell + rested
