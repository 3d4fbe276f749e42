"""Compiled encoder and velocity filter, one sample at a time.

Filter memory of one channel: (last angle, z1, z2) of a second-order section in
transposed direct form II, fed with backward differences.
"""

from math import floor

from drill_env._jit import kernel


@kernel
def quantise(angle, quantum):
    """Angle (rad) as whole counts of `quantum` rad, rounded to the nearest; 0 passes through."""
    if quantum <= 0.0:
        return angle
    return floor(angle / quantum + 0.5) * quantum


@kernel
def start_filter(memory, angle, omega, b, a):
    """Set the filter to the steady state of a constant velocity `omega` (rad/s)."""
    memory[0] = angle
    memory[2] = (b[2] - a[2]) * omega
    memory[1] = (b[1] - a[1]) * omega + memory[2]


@kernel
def filter_sample(memory, angle, rate, b, a):
    """Velocity (rad/s) after one more angle sample (rad) at `rate` Hz."""
    difference = (angle - memory[0]) * rate
    velocity = b[0] * difference + memory[1]
    memory[1] = b[1] * difference - a[1] * velocity + memory[2]
    memory[2] = b[2] * difference - a[2] * velocity
    memory[0] = angle
    return velocity


@kernel
def filter_series(angles, memory, rate, b, a, out):
    """Velocity (rad/s) of a whole series of angle samples."""
    for i in range(angles.size):
        out[i] = filter_sample(memory, angles[i], rate, b, a)
