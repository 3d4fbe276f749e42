"""Compiled derivatives of the innovations by the noise, along a pass of the filter.

The transitions of the pass are held: the noise moves gains and variances, and these move the
filtered state. All numbers of a noise model are carried side by side, in blocks of `N_NOISE`. The
derivative of the covariance is a matrix `H` plus its transpose, so that a product over all blocks
of a row is one long loop, which compiles to a few wide instructions.
"""

from math import exp

import numpy as np

from drill_env._jit import entry, inlined, kernel
from drill_env.identification._filter_reading import reading_row
from drill_env.identification._filter_state import D_L, D_U, N_FILTER
from drill_env.integrator.records import N_STATE

N_NOISE = 8
_SENSORS = 4  # where their numbers begin
_BLOCKS = N_FILTER * N_NOISE
_STATE = _BLOCKS  # where the state's derivative begins in a row of `H`

NOISE_SLOPES = np.dtype(
    [
        ("variance", "f8", (2,)),  # of the latent torques, Nm^2
        ("rate", "f8", (2,)),  # reciprocals of their correlation times, 1/s
        ("robust", "f8"),  # innovations beyond so many standard deviations lose weight
        ("release", "f8"),  # and beyond so many free a stuck disc
        ("relative", "i8"),  # see `reading_row`
        ("P", "f8", (N_FILTER, N_FILTER)),
        ("FP", "f8", (N_FILTER, N_FILTER)),
        ("PH", "f8", (N_FILTER,)),
        # Derivatives by the logarithms of the numbers.
        ("H", "f8", (N_FILTER, _BLOCKS + N_NOISE)),
        ("FH", "f8", (N_FILTER, _BLOCKS + N_NOISE)),
        ("turned", "f8", (N_FILTER, _BLOCKS)),
        ("dPH", "f8", (_BLOCKS,)),
        ("taken", "f8", (_BLOCKS,)),
        ("dS", "f8", (N_NOISE,)),
        ("dgap", "f8", (N_NOISE,)),
        ("dused", "f8", (N_NOISE,)),
    ],
    align=True,
)
"""Working arrays of one recording."""


@kernel
def begin(w):
    """No doubt about the start but the torques'."""
    for i in range(N_FILTER):
        for j in range(N_FILTER):
            w.P[i, j] = 0.0
        for k in range(_BLOCKS + N_NOISE):
            w.H[i, k] = 0.0
    for disc in range(2):
        row = D_U + disc
        w.P[row, row] = w.H[row, row * N_NOISE + disc] = w.variance[disc]


@inlined
def spread(w, transition, decay_u, decay_l):
    """The covariance over an interval, without what is added to the torques."""
    for i in range(N_STATE):
        for j in range(N_FILTER):
            total = 0.0
            for m in range(N_FILTER):
                total += transition[i, m] * w.P[m, j]
            w.FP[i, j] = total
    for j in range(N_FILTER):
        w.FP[D_U, j], w.FP[D_L, j] = decay_u * w.P[D_U, j], decay_l * w.P[D_L, j]
    for i in range(N_FILTER):
        for j in range(min(i + 1, N_STATE)):
            total = 0.0
            for m in range(N_FILTER):
                total += w.FP[i, m] * transition[j, m]
            w.P[i, j] = w.P[j, i] = total
        w.P[i, D_U], w.P[i, D_L] = decay_u * w.FP[i, D_U], decay_l * w.FP[i, D_L]
        w.P[D_U, i], w.P[D_L, i] = w.P[i, D_U], w.P[i, D_L]


@inlined
def spread_slopes(w, transition, decay_u, decay_l):
    """Derivatives of covariance and state over an interval, the transition held."""
    for i in range(N_STATE):
        a, b, c = transition[i, 0], transition[i, 1], transition[i, 2]
        d, e, f = transition[i, 3], transition[i, 4], transition[i, 5]
        for k in range(_BLOCKS + N_NOISE):
            w.FH[i, k] = (
                a * w.H[0, k] + b * w.H[1, k] + c * w.H[2, k]
                + d * w.H[3, k] + e * w.H[4, k] + f * w.H[5, k]
            )  # fmt: skip
    for k in range(_BLOCKS + N_NOISE):
        w.FH[D_U, k], w.FH[D_L, k] = decay_u * w.H[D_U, k], decay_l * w.H[D_L, k]
    for i in range(N_FILTER):
        for j in range(N_FILTER):
            for c in range(N_NOISE):
                w.turned[j, i * N_NOISE + c] = w.FH[i, j * N_NOISE + c]
        for c in range(N_NOISE):
            w.H[i, _STATE + c] = w.FH[i, _STATE + c]
    for i in range(N_STATE):
        a, b, c = transition[i, 0], transition[i, 1], transition[i, 2]
        d, e, f = transition[i, 3], transition[i, 4], transition[i, 5]
        for k in range(_BLOCKS):
            w.H[i, k] = (
                a * w.turned[0, k] + b * w.turned[1, k] + c * w.turned[2, k]
                + d * w.turned[3, k] + e * w.turned[4, k] + f * w.turned[5, k]
            )  # fmt: skip
    for k in range(_BLOCKS):
        w.H[D_U, k], w.H[D_L, k] = decay_u * w.turned[D_U, k], decay_l * w.turned[D_L, k]


@inlined
def renew(w, disc, decay, state, dt):
    """What an interval adds to a torque's variance, and how that and its decay follow the noise."""
    row, fresh = D_U + disc, (1.0 - decay * decay) * w.variance[disc]
    size, time = disc, 2 + disc
    slower = decay * dt * w.rate[disc]
    w.P[row, row] += fresh
    for j in range(N_FILTER):
        w.H[row, j * N_NOISE + time] += slower * w.FP[j, row]
    w.H[row, row * N_NOISE + size] += fresh
    w.H[row, row * N_NOISE + time] -= decay * slower * w.variance[disc]
    w.H[row, _STATE + time] += slower * state[row]


@inlined
def foresee(w, reading, noise):
    """Put a reading's row of the measurement into `PH`, `dPH`, `dS` and `dgap`; its variance."""
    a, b, row = reading_row(reading, w.relative)
    for k in range(_BLOCKS):
        w.dPH[k] = a * w.H[0, k] + b * w.H[row, k]
    for i in range(N_FILTER):
        w.PH[i] = a * w.P[i, 0] + b * w.P[i, row]
        for c in range(N_NOISE):
            w.dPH[i * N_NOISE + c] += a * w.H[i, c] + b * w.H[i, row * N_NOISE + c]
    for c in range(N_NOISE):
        w.dS[c] = a * w.dPH[c] + b * w.dPH[row * N_NOISE + c]
        w.dgap[c] = -a * w.H[0, _STATE + c] - b * w.H[row, _STATE + c]
    w.dS[_SENSORS + reading] += 2.0 * noise
    return a * w.PH[0] + b * w.PH[row] + noise


@inlined
def take_in(w, gap, variance):
    """Carry the derivatives through the sample that was foreseen."""
    used = variance
    for c in range(N_NOISE):
        w.dused[c] = w.dS[c]
    if gap * gap > w.robust * w.robust * variance:
        used = abs(gap) * variance**0.5 / w.robust
        for c in range(N_NOISE):
            w.dused[c] = used * (w.dgap[c] / gap + 0.5 * w.dS[c] / variance)
    share = 1.0 / used
    for i in range(N_FILTER):
        gain = w.PH[i] * share
        for c in range(N_NOISE):
            w.taken[i * N_NOISE + c] = gain * w.dused[c]
            w.H[i, _STATE + c] += gain * w.dgap[c]
        for j in range(N_FILTER):
            w.P[i, j] -= gain * w.PH[j]
    moved = gap * share
    for i in range(N_FILTER):
        for c in range(N_NOISE):
            k = i * N_NOISE + c
            w.H[i, _STATE + c] += moved * (w.dPH[k] - w.taken[k])
    for k in range(_BLOCKS):
        w.taken[k] = (w.dPH[k] - 0.5 * w.taken[k]) * share
    for i in range(N_FILTER):
        size = w.PH[i]
        for k in range(_BLOCKS):
            w.H[i, k] -= size * w.taken[k]


@kernel
def rest(w, row, stuck):
    """A disc at rest, or one that a sample would have turned round, stops for every noise."""
    for c in range(N_NOISE):
        w.H[row, _STATE + c] = 0.0
    if not stuck:
        return
    for k in range(_BLOCKS):
        w.H[row, k] = 0.0
    for i in range(N_FILTER):
        w.P[row, i] = w.P[i, row] = 0.0
        for c in range(N_NOISE):
            w.H[i, row * N_NOISE + c] = 0.0


@kernel
def let_go(w, transition, reading, gap, variance, dt):
    """A disc that the filter freed as its sensor said, with doubt that no noise changes."""
    row = 1 + reading % 2
    for m in range(N_FILTER):
        # A disc that rests at the end of an interval has a speed that follows nothing.
        if transition[row, m] != 0.0:
            return
    if gap * gap >= w.release * w.release * variance:
        w.P[row, row] = gap * gap + variance
        if reading < 2:
            w.P[row, row] /= dt * dt


@entry
def noise_slopes(
    w, t, restarts, transitions, stuck, states, innovations, seen, noise, by_size, by_gap
):  # fmt: skip
    """How innovations and their variances follow the logarithms of a noise model.

    Args:
        w: record of `NOISE_SLOPES`.
        t: times in s, shape (n,).
        restarts: rows at which the filter starts anew, ascending, the first 0; shape (m,).
        transitions: into each row, shape (n, 4, 6).
        stuck: which discs rest at each row, shape (n, 2).
        states: filtered, shape (n, 6).
        innovations: shape (n, readings).
        seen: their variances, 0 where no sample is, shape (n, readings).
        noise: variances of the samples, shape (n, readings).
        by_size: filled with the slopes of the variances over the variances, shape
            (n, readings, 8); left where no sample is.
        by_gap: filled with those of the innovations, rad or rad/s, likewise.
    """
    window = 0
    for k in range(t.size):
        if window < restarts.size and restarts[window] == k:
            window += 1
            begin(w)
        else:
            dt = t[k] - t[k - 1]
            decay_u, decay_l = exp(-w.rate[0] * dt), exp(-w.rate[1] * dt)
            spread(w, transitions[k], decay_u, decay_l)
            spread_slopes(w, transitions[k], decay_u, decay_l)
            renew(w, 0, decay_u, states[k - 1], dt)
            renew(w, 1, decay_l, states[k - 1], dt)
        for e in range(innovations.shape[1]):
            if seen[k, e] == 0.0:
                continue
            gap = innovations[k, e]
            variance = foresee(w, e, noise[k, e])
            share = 1.0 / variance
            for c in range(N_NOISE):
                by_size[k, e, c], by_gap[k, e, c] = w.dS[c] * share, w.dgap[c]
            take_in(w, gap, variance)
            if w.release > 0.0 and k > 0:
                let_go(w, transitions[k], e, gap, variance, t[k] - t[k - 1])
        for disc in range(2):
            if states[k, 1 + disc] == 0.0:
                rest(w, 1 + disc, stuck[k, disc])
