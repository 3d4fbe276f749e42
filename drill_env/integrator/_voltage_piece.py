"""Compiled voltage of the present piece, a polynomial in the share of its length."""

from drill_env._jit import kernel


@kernel
def voltage_at(work, t):
    """Voltage (V) of the present piece at time `t` (s)."""
    n = work.coefficients
    if n == 1:
        return work.piece[0]
    s = (t - work.start) / (work.end - work.start)
    value = work.piece[n - 1]
    for i in range(n - 2, -1, -1):
        value = value * s + work.piece[i]
    return value


@kernel
def voltage_slope(work, t):
    """Time derivative of the voltage (V/s) of the present piece."""
    n = work.coefficients
    if n == 1:
        return 0.0
    length = work.end - work.start
    s = (t - work.start) / length
    value = 0.0
    for i in range(n - 1, 0, -1):
        value = value * s + i * work.piece[i]
    return value / length
