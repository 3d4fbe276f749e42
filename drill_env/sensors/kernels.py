"""Compiled encoder and velocity filter, one sample at a time.

Filter memory of one channel: (last angle, z1, z2) of a second-order section in
transposed direct form II, fed with backward differences.
"""

from math import exp, log1p

import numpy as np

from drill_env._jit import entry, inlined, kernel

# Below this the chance to lose none is 0 in double precision, and the sum would not begin.
_LEAST_EXPONENT = -700.0


@inlined
def quantise(angle, quantum):
    """Angle (rad) as whole counts of `quantum` rad, rounded to the nearest; 0 passes through."""
    if quantum <= 0.0:
        return angle
    return np.floor(angle / quantum + 0.5) * quantum


@entry
def start_filter(memory, angle, omega, b, a):
    """Set the filter to the steady state of a constant velocity `omega` (rad/s)."""
    memory[0] = angle
    memory[2] = (b[2] - a[2]) * omega
    memory[1] = (b[1] - a[1]) * omega + memory[2]


@inlined
def filter_step(last, z1, z2, angle, rate, b, a):
    """Velocity (rad/s) after one more angle (rad) at `rate` Hz, and the new (z1, z2)."""
    difference = (angle - last) * rate
    velocity = b[0] * difference + z1
    z1 = b[1] * difference - a[1] * velocity + z2
    return velocity, z1, b[2] * difference - a[2] * velocity


@entry
def filter_sample(memory, angle, rate, b, a):
    """As `filter_step`, its memory kept in an array."""
    velocity, z1, z2 = filter_step(memory[0], memory[1], memory[2], angle, rate, b, a)
    memory[0], memory[1], memory[2] = angle, z1, z2
    return velocity


@entry
def filter_series(angles, memory, rate, b, a, out):
    """Velocity (rad/s) of a whole series of angle samples."""
    for i in range(angles.size):
        out[i] = filter_sample(memory, angles[i], rate, b, a)


@kernel
def lost_counts(moved, chance, uniform):
    """Counts lost of `moved` whole ones, of its sign: binomial, by inversion of one uniform draw.

    Where hundreds are lost on average, their mean stands for them.
    """
    count = abs(moved)
    if chance >= 1.0 or count == 0.0:
        return moved
    exponent = count * log1p(-chance)
    if exponent < _LEAST_EXPONENT:
        lost = np.floor(count * chance + 0.5)
    else:
        lost, share = 0.0, exp(exponent)
        total = share
        while total < uniform and lost < count:
            share *= (count - lost) / (lost + 1.0) * chance / (1.0 - chance)
            lost += 1.0
            total += share
    return lost if moved > 0.0 else -lost


@entry
def lose_counts(counts, chance, uniforms):
    """Take the lost counts off a series of whole counts, in place."""
    before, gone = counts[0], 0.0
    for i in range(counts.size):
        gone += lost_counts(counts[i] - before, chance, uniforms[i])
        before = counts[i]
        counts[i] -= gone
