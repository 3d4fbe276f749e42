"""Compiled inner states and mean torques of an effect over an interval of straight motion."""

from math import ceil, exp

from numba import float64, from_dtype, types
from numba.core.typing.templates import signature

from drill_env._jit import caller, inlined, kernel, unit
from drill_env.effects._along_ports import (
    acceleration_u,
    ask,
    set_speeds,
    torque_on_lower,
    torque_on_upper,
)
from drill_env.effects.pace import MOVE, fastest_rate
from drill_env.effects.signal import ENTRY, PORTS, SIGNAL
from drill_env.friction.kernels import lower_size
from drill_env.parameters.record import PARAMETERS

_OVER = signature(
    types.none, *(from_dtype(kind) for kind in (PARAMETERS, ENTRY, SIGNAL, PORTS)),
    float64[::1], float64[::1], float64, float64, float64, float64[:, ::1], float64[::1],
)  # fmt: skip

# Rates times the substep: far inside the method's stability, 2.8.
_SHARE, _MOST = 1.0, 1000


@inlined
def relax(p, e, s, out, h, mean, share):
    """Carry one inner state over `h` s in the signal at their middle, and add the mean torques.

    The exponential midpoint step (Hochbruck and Ostermann, Acta Numerica 19, 2010): whatever is
    quick beside the interval has relaxed and does not blow up.
    """
    ask(p, e, s, out)
    kept, rate = e.z[0], e.rate[0]
    step = MOVE * (1.0 + abs(kept))
    e.z[0] = kept + step
    ask(p, e, s, out)
    shares = h * (rate - e.rate[0]) / step
    left_over = 1.0 - 0.5 * shares if abs(shares) < 1e-4 else (1.0 - exp(-shares)) / shares
    # The mean of the residual share, too.
    gone = 0.5 - shares / 6.0 if abs(shares) < 1e-4 else (1.0 - left_over) / shares
    e.z[0] = kept + h * rate * gone
    ask(p, e, s, out)
    mean[0] += share * torque_on_upper(p, s, out)
    mean[1] += share * torque_on_lower(p, s, out)
    e.z[0] = kept + h * rate * left_over


@kernel
def runge_kutta(p, e, s, out, begin, rate, since, h, u, z, mean, share):
    """Carry several inner states over `h` s by the classical method of Runge and Kutta."""
    start, dwell = s.t - since, s.dwell_l - since
    for stage in range(4):
        part = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
        s.t, s.dwell_l = start + since + part * h, dwell + since + part * h
        move(p, e, s, begin, rate, since + part * h, u)
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


@inlined
def move(p, e, s, begin, rate, since, u):
    """Signal `since` seconds into a straight interval, as far as the effect reads it."""
    set_speeds(
        p, s, begin[0] + since * rate[0], begin[1] + since * rate[1], begin[2] + since * rate[2],
        begin[3] + since * rate[3], u,
    )  # fmt: skip
    if e.reads_law:
        s.friction_l = lower_size(p, s.speed_l)


@inlined
def between(p, e, s, out, begin, rate, t, dwell, dt, u, cuts, mean):
    """Mean torques of an effect without inner states, cut where its switches close.

    Each part between two cuts has the torque of its middle; what a switch is a function of is
    taken as straight.
    """
    count = 0
    if e.switches > 0:
        for end in range(2):
            s.t = t + end * dt
            move(p, e, s, begin, rate, end * dt, u)
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
        move(p, e, s, begin, rate, middle, u)
        ask(p, e, s, out)
        mean[0] += (high - low) * torque_on_upper(p, s, out)
        if not e.upper:
            mean[1] += (high - low) * torque_on_lower(p, s, out)
        low = high


@unit(_OVER)
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
    if s.first or e.states > 1:
        move(p, e, s, begin, rate, 0.0, u)
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
        move(p, e, s, begin, rate, (k + 0.5) * h, u)
        relax(p, e, s, out, h, mean, 1.0 / n)
    if e.drives:
        # Carried on relative to the disc, whose speed a filter may move.
        e.z[1] -= begin[1] + dt * rate[1]
    s.choose = 0


call_over_interval = caller(_OVER)
"""For kernels: `call_over_interval(address of over_interval, *arguments)`."""
