"""Compiled voltage of the present piece, a polynomial in the share of its length."""

from drill_env._intrinsics import number_at
from drill_env._jit import inlined, kernel


@kernel
def load_piece(run, work):
    """Make the present voltage piece the one that steps read."""
    columns = work.coefficients + work.late
    work.start, work.end = number_at(work.breaks, run.piece), number_at(work.breaks, run.piece + 1)
    for i in range(work.coefficients):
        work.piece[i] = number_at(work.pieces, run.piece * columns + i)
    for i in range(work.late):
        work.past[i] = number_at(work.pieces, run.piece * columns + work.coefficients + i)
    work.has_rates = 0


@inlined
def polynomial_at(work, coefficients, n, t):
    """Value at time `t` (s) of a polynomial in the share of the present piece."""
    s = (t - work.start) / (work.end - work.start)
    value = 0.0
    for i in range(n - 1, -1, -1):
        value = value * s + coefficients[i]
    return value


@kernel
def voltage_at(work, t):
    """Voltage (V) of the present piece at time `t` (s)."""
    if work.coefficients == 1:
        return work.piece[0]
    return polynomial_at(work, work.piece, work.coefficients, t)


@inlined
def past_voltage_at(work, t):
    """Voltage (V) that held a delay before `t` (s)."""
    return polynomial_at(work, work.past, work.late, t)


@inlined
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
