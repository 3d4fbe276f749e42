"""Compiled update of the filter by one reading, and the record of what it did."""

from math import log

from drill_env._jit import inlined, kernel
from drill_env.identification._filter_reading import reading_row
from drill_env.identification._filter_state import N_FILTER, START_OFFSET
from drill_env.integrator.records import N_STATE
from drill_env.parameters.record import N_PARAMETERS

# One logarithm for many variances, before their product leaves what a number can hold.
_LEAST, _MOST = 1e-250, 1e250


@kernel
def take_volume(f):
    """Take the product of the variances so far into the value."""
    f.value += log(f.volume)
    f.volume = 1.0


@inlined
def foresee_reading(f, reading):
    """Put a reading's row of the measurement into `PH` and `slope`; its value and variance."""
    a, b, row = reading_row(reading, f.relative)
    for i in range(N_FILTER):
        f.PH[i] = a * f.P[i, 0] + b * f.P[i, row]
    for c in range(f.slopes):
        f.slope[c] = a * f.S[0, c] + b * f.S[row, c]
    if f.slopes > 0:
        f.slope[N_PARAMETERS + START_OFFSET] -= a
    return a * (f.y[0] - f.offset) + b * f.y[row], a * f.PH[0] + b * f.PH[row]


@kernel
def update(f, reading, measured, noise, gradient, information):
    """Take one sample in; returns its innovation (rad or rad/s) and the variance of that."""
    expected, spread = foresee_reading(f, reading)
    gap, variance = measured - expected, spread + noise
    used, loss = variance, gap * gap / variance
    if gap * gap > f.robust * f.robust * variance:
        # Huber's weight: the sample counts as one of larger noise.
        used = abs(gap) * variance**0.5 / f.robust
        loss = 2.0 * gap * gap / used - f.robust * f.robust
    f.value += loss
    f.volume *= variance
    if not _LEAST < f.volume < _MOST:
        take_volume(f)
    f.count += 1
    # A path's reader sums them up itself, and the errors of its own along with them.
    if f.summed:
        for c in range(f.slopes):
            gradient[c] += f.slope[c] * gap / used
            for d in range(c + 1):
                information[c, d] += f.slope[c] * f.slope[d] / used
    for i in range(N_FILTER):
        gain = f.PH[i] / used
        f.y[i] += gain * gap
        for c in range(f.slopes):
            f.S[i, c] -= gain * f.slope[c]
        for j in range(N_FILTER):
            f.P[i, j] -= gain * f.PH[j]
    return gap, variance


@kernel
def note_gain(f, row, reading, gap, variance):
    """Keep the gain of the sample just taken; returns its weight."""
    used = max(variance, abs(gap) * variance**0.5 / f.robust)
    row.weight[reading] = 1.0 / used**0.5 if variance > 0.0 else 0.0
    row.white[reading] = gap * row.weight[reading]
    for i in range(N_FILTER):
        row.gain[reading, i] = f.PH[i] / used if variance > 0.0 else 0.0
    return row.weight[reading]


@kernel
def note_transition(f, run, row):
    """Keep the transition into the row, the doubt after it, and which discs stick there."""
    for i in range(N_FILTER):
        for j in range(N_FILTER):
            row.P[i, j] = f.P[i, j]
    for i in range(N_STATE):
        for m in range(N_FILTER):
            row.F[i, m] = f.F[i, m]
    row.stuck[0], row.stuck[1] = run.mode[0] == 0, run.mode[1] == 0
