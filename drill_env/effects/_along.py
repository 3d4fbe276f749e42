"""Compiled torques and reading errors of an effect along a motion that is known.

Over an interval the motion is straight; the effect's inner states follow it, and its torque is the
mean over the interval.
"""

from math import ceil, exp, sqrt

from drill_env._jit import entry, inlined, kernel
from drill_env.effects.signal import RESTING, respond
from drill_env.friction.kernels import lower_sliding

# Rates times the substep: far inside the method's stability, 2.8.
_SHARE, _MOST = 1.0, 1000
_MOVE = 1e-6


@inlined
def sign(value):
    """-1, 0 or 1."""
    return 1.0 if value > 0.0 else (-1.0 if value < 0.0 else 0.0)


@kernel
def set_motion(p, s, x, v, w, angle, u):
    """Signal of a state under a voltage, with what follows from both."""
    s.twist, s.omega_u, s.omega_l, s.theta_l, s.u = x, v, w, angle, u
    s.theta_u = angle + x
    s.pull = p.ktheta * x
    s.speed_u, s.speed_l = abs(v), abs(w)
    s.rest_u, s.rest_l = v == 0.0, w == 0.0
    s.side_u = sign(p.km * u - s.pull) if s.rest_u else sign(v)
    s.side_l = sign(s.pull) if s.rest_l else sign(w)
    side = 0.0 if s.rest_u else s.side_u
    s.friction_u = p.Tsu + side * p.dTsu + (p.bu + side * p.dbu) * s.speed_u
    s.friction_l = lower_size(p, s.speed_l)


@kernel
def lower_size(p, speed):
    """Size (Nm) of the lower disc's own friction."""
    torque = lower_sliding(p, speed)
    return 0.0 if p.clamp and torque < 0.0 else torque


@kernel
def clear(out, s):
    """Nothing added to the ports."""
    out.volts = out.torque_u = out.torque_l = out.string = 0.0
    out.size_u = out.size_l = out.scale_u = out.scale_l = out.inertia_u = 0.0
    out.angle_u = out.angle_l = 0.0
    out.drive = 1.0
    out.read_l = s.speed_l


@kernel
def against(omega, net, torque):
    """The torque (Nm) with which additional friction of size `torque` acts on a disc.

    A resting disc is held by no more than what pulls on it; less friction pushes it on.
    """
    if omega != 0.0:
        return -sign(omega) * torque
    if torque >= 0.0:
        return -min(max(net, -torque), torque)
    return -sign(net) * torque


@kernel
def left(omega, net, size):
    """Torque (Nm) that friction of a size leaves of what pulls on a disc."""
    if omega != 0.0:
        return net - sign(omega) * size
    return net - min(max(net, -size), size)


@kernel
def torque_on_upper(p, s, out):
    """What the ports are as a torque (Nm) on the rig's own upper disc."""
    plain = p.km * s.u - s.pull
    net = out.drive * p.km * (s.u + out.volts) + out.torque_u - s.pull - out.string
    more = s.friction_u * out.scale_u + out.size_u
    if out.drive == 1.0:
        return net - plain + against(s.omega_u, net + s.other_u, more)
    return p.Ju * acceleration_u(p, s, out) - left(s.omega_u, plain, s.friction_u)


@kernel
def acceleration_u(p, s, out):
    """Acceleration (rad/s^2) of the upper disc with what the ports are."""
    net = out.drive * p.km * (s.u + out.volts) + out.torque_u - s.pull - out.string
    size = s.friction_u * (1.0 + out.scale_u) + out.size_u
    return left(s.omega_u, net, size) / (p.Ju + out.inertia_u)


@kernel
def torque_on_lower(p, s, out):
    """What the ports are as a torque (Nm) on the rig's own lower disc."""
    more = out.string + out.torque_l
    law = s.friction_l if out.read_l == s.speed_l else lower_size(p, out.read_l)
    extra = law * (1.0 + out.scale_l) + out.size_l - s.friction_l
    return more + against(s.omega_l, s.pull + more + s.other_l, extra)


@kernel
def ask(p, e, s, out):
    """Let the effect add to clear ports."""
    clear(out, s)
    respond(e.code, p, e, s, out)


@kernel
def relax(p, e, s, out, h, mean):
    """Carry one inner state over `h` s in the signal at their middle, and add the mean torques.

    The exponential midpoint step (Hochbruck and Ostermann, Acta Numerica 19, 2010): whatever is
    quick beside the interval has relaxed and does not blow up.
    """
    ask(p, e, s, out)
    kept, rate = e.z[0], e.rate[0]
    step = _MOVE * (1.0 + abs(kept))
    e.z[0] = kept + step
    ask(p, e, s, out)
    shares = h * (rate - e.rate[0]) / step
    left_over = 1.0 - 0.5 * shares if abs(shares) < 1e-4 else (1.0 - exp(-shares)) / shares
    # The mean of what is left over, too.
    gone = 0.5 - shares / 6.0 if abs(shares) < 1e-4 else (1.0 - left_over) / shares
    e.z[0] = kept + h * rate * gone
    ask(p, e, s, out)
    mean[0] += torque_on_upper(p, s, out)
    mean[1] += torque_on_lower(p, s, out)
    e.z[0] = kept + h * rate * left_over


@kernel
def fastest_rate(p, e, s, out, slopes):
    """Largest rate (1/s) at which several inner states relax or ring."""
    ask(p, e, s, out)
    for i in range(e.states):
        slopes[4, i] = e.rate[i]
    for j in range(e.states):
        kept = e.z[j]
        step = _MOVE * (1.0 + abs(kept))
        e.z[j] = kept + step
        ask(p, e, s, out)
        e.z[j] = kept
        for i in range(e.states):
            slopes[i, j] = (e.rate[i] - slopes[4, i]) / step
    fastest = 0.0
    for i in range(e.states):
        for j in range(e.states):
            # Of a pair that rings both slopes across together are the square of its frequency.
            fastest = max(fastest, sqrt(abs(slopes[i, j] * slopes[j, i])))
    return fastest


@kernel
def runge_kutta(p, e, s, out, begin, rate, since, h, u, z, mean, share):
    """Carry several inner states over `h` s by the classical method of Runge and Kutta."""
    start, dwell = s.t - since, s.dwell_l - since
    for stage in range(4):
        part = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
        s.t, s.dwell_l = start + since + part * h, dwell + since + part * h
        move(p, s, begin, rate, since + part * h, u)
        for j in range(e.states):
            if stage > 0:
                e.z[j] = z[4, j] + part * h * z[stage - 1, j]
        ask(p, e, s, out)
        weight = share * (1.0 if stage in (0, 3) else 2.0) / 6.0
        mean[0] += weight * torque_on_upper(p, s, out)
        mean[1] += weight * torque_on_lower(p, s, out)
        for j in range(e.states):
            if stage == 0:
                # What came to rest has been put there.
                z[4, j] = e.z[j]
            z[stage, j] = e.rate[j]
        if e.drives:
            # The motor's speed ahead of the disc follows from the torques, not from the disc's
            # measured motion: smoothing takes the gear's ringing out of that.
            z[stage, 1] += rate[1] - acceleration_u(p, s, out)
    for j in range(e.states):
        e.z[j] = z[4, j] + h * (z[0, j] + 2.0 * z[1, j] + 2.0 * z[2, j] + z[3, j]) / 6.0


@kernel
def move(p, s, begin, rate, since, u):
    """Signal `since` seconds into a straight interval."""
    set_motion(
        p, s, begin[0] + since * rate[0], begin[1] + since * rate[1], begin[2] + since * rate[2],
        begin[3] + since * rate[3], u,
    )  # fmt: skip


@kernel
def between(p, e, s, out, begin, rate, t, dwell, dt, u, cuts, mean):
    """Mean torques of an effect without inner states, cut where its switches close.

    Each part between two cuts has the torque of its middle; what a switch is a function of is
    taken as straight.
    """
    count = 0
    if e.switches > 0:
        for end in range(2):
            s.t = t + end * dt
            move(p, s, begin, rate, end * dt, u)
            for j in range(e.switches):
                e.side[j], e.gap[j] = 0, 1.0
            ask(p, e, s, out)
            for j in range(e.switches):
                cuts[end, j] = e.side[j] * e.gap[j]
        for j in range(e.switches):
            if cuts[0, j] * cuts[1, j] < 0.0:
                place, share = count, cuts[0, j] / (cuts[0, j] - cuts[1, j])
                while place > 0 and cuts[2, place - 1] > share:
                    cuts[2, place] = cuts[2, place - 1]
                    place -= 1
                cuts[2, place] = share
                count += 1
    low = 0.0
    for i in range(count + 1):
        high = cuts[2, i] if i < count else 1.0
        middle = 0.5 * (low + high) * dt
        s.t, s.dwell_l = t + middle, dwell + middle
        move(p, s, begin, rate, middle, u)
        ask(p, e, s, out)
        mean[0] += (high - low) * torque_on_upper(p, s, out)
        mean[1] += (high - low) * torque_on_lower(p, s, out)
        low = high


@kernel
def over_interval(p, e, s, out, begin, rate, t, dt, u, z, mean):
    """Carry the inner states of an effect over an interval of `dt` s from `t`.

    Args:
        p: record of `PARAMETERS`.
        e: record of `ENTRY`.
        s: record of `SIGNAL`; `first`, `dwell_l` and `u_rate` are the caller's.
        out: record of `PORTS`.
        begin: twist, omega_u, omega_l, theta_l there.
        rate: their rates over the interval.
        t: begin of the interval, s.
        dt: its length, s.
        u: held voltage, V.
        z: working array, shape (5, MOST_STATES).
        mean: the mean torques on both discs, Nm, are added to it.
    """
    dwell = s.dwell_l
    s.choose = 1
    s.t = t
    move(p, s, begin, rate, 0.0, u)
    if s.first:
        ask(p, e, s, out)
        s.first = 0
    elif e.drives:
        e.z[1] += begin[1]
    n = 1
    if e.states == 1:
        n = 4 if e.switches > 0 else 2
    elif e.states > 1:
        n = min(max(int(ceil(fastest_rate(p, e, s, out, z) * dt / _SHARE)), 1), _MOST)
    h = dt / n
    for k in range(n):
        if e.states > 1:
            s.t, s.dwell_l = t + k * h, dwell + k * h
            runge_kutta(p, e, s, out, begin, rate, k * h, h, u, z, mean, 1.0 / n)
            continue
        if e.states == 0:
            between(p, e, s, out, begin, rate, t, dwell, dt, u, z, mean)
            break
        s.t, s.dwell_l = t + (k + 0.5) * h, dwell + (k + 0.5) * h
        move(p, s, begin, rate, (k + 0.5) * h, u)
        z[0, 0] = z[0, 1] = 0.0
        relax(p, e, s, out, h, z[0])
        mean[0] += z[0, 0] / n
        mean[1] += z[0, 1] / n
    if e.drives:
        # Carried on relative to the disc, whose speed a filter may move.
        e.z[1] -= begin[1] + dt * rate[1]
    s.choose = 0


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
def late_angle(t, motion, k, first, delay, column):
    """Angle (rad) a delay before row `k`, of column 0 theta_u or 1 theta_l; cubic between rows."""
    wanted, row = t[k] - delay, k
    while row > first and t[row] > wanted:
        row -= 1
    share, dt = 0.0, 0.0
    if wanted > t[row]:
        dt = t[row + 1] - t[row]
        share = (wanted - t[row]) / dt
    theta, far = motion[row, 3], 0.0
    slope, far_slope = motion[row, 2], 0.0
    if column == 0:
        theta, slope = theta + motion[row, 0], motion[row, 1]
    if share == 0.0:
        return theta
    far, far_slope = motion[row + 1, 3], motion[row + 1, 2]
    if column == 0:
        far, far_slope = far + motion[row + 1, 0], motion[row + 1, 1]
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
