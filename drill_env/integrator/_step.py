"""Compiled Runge-Kutta step in one mode, its error estimate and its dense output."""

from math import sqrt

from drill_env._jit import kernel
from drill_env.dynamics._kernels import lower_rate, upper_rate


@kernel
def voltage_at(piece, length, elapsed):
    """Voltage (V) of one polynomial piece, `elapsed` s after its start."""
    n = piece.size
    if n == 1:
        return piece[0]
    s = elapsed / length
    value = piece[n - 1]
    for i in range(n - 2, -1, -1):
        value = value * s + piece[i]
    return value


@kernel
def voltage_slope(piece, length, elapsed):
    """Time derivative of the voltage (V/s) of one polynomial piece."""
    n = piece.size
    if n == 1:
        return 0.0
    s = elapsed / length
    value = 0.0
    for i in range(n - 1, 0, -1):
        value = value * s + i * piece[i]
    return value / length


@kernel
def fill_rates(p, mode, k, stage, x0, x1, x2, u):
    """Store the rates of (twist, omega_u, omega_l, theta_l) as one stage."""
    k[stage, 0] = x1 - x2
    k[stage, 1] = upper_rate(p, mode[0], x0, x1, u)
    k[stage, 2] = lower_rate(p, mode[1], mode[2], x0, x2)
    k[stage, 3] = x2


@kernel
def run_stages(p, mode, y, piece, length, elapsed, h, tableau, k, ys, first, last):
    """Fill stages `first`..`last` of a step of `h` s; `ys` keeps the stage states."""
    a = tableau.a
    upper, lower, clamped = mode[0], mode[1], mode[2]
    u = piece[0]
    for i in range(first, last + 1):
        d0 = d1 = d2 = d3 = 0.0
        for j in range(i):
            w = a[i, j]
            if w != 0.0:
                d0 += w * k[j, 0]
                d1 += w * k[j, 1]
                d2 += w * k[j, 2]
                d3 += w * k[j, 3]
        x0 = y[0] + h * d0
        x1 = y[1] + h * d1
        x2 = y[2] + h * d2
        ys[i, 0] = x0
        ys[i, 1] = x1
        ys[i, 2] = x2
        ys[i, 3] = y[3] + h * d3
        if piece.size > 1:
            u = voltage_at(piece, length, elapsed + tableau.c[i] * h)
        k[i, 0] = x1 - x2
        k[i, 1] = upper_rate(p, upper, x0, x1, u)
        k[i, 2] = lower_rate(p, lower, clamped, x0, x2)
        k[i, 3] = x2


@kernel
def error_norm(y, ys, k, h, tableau, rtol, atol):
    """Scaled error of the step just taken; at most 1 is accepted."""
    n = tableau.stages
    high2 = low2 = 0.0
    for i in range(3):
        high = low = 0.0
        for j in range(n + 1):
            high += tableau.error_high[j] * k[j, i]
            low += tableau.error_low[j] * k[j, i]
        size = abs(y[i])
        end = abs(ys[n, i])
        scale = atol + rtol * (end if end > size else size)
        high2 += (high / scale) ** 2
        low2 += (low / scale) ** 2
    if high2 == 0.0:
        return 0.0
    if tableau.extra == 0:
        return h * sqrt(high2 / 3.0)
    # Hairer's combination of the fifth and third order estimates (DOP853).
    return h * high2 / sqrt((high2 + 0.01 * low2) * 3.0)


@kernel
def fill_dense(h, tableau, k, first, last, dense):
    """Monomial coefficients of components `first`..`last` over the step."""
    n = tableau.stages + 1 + tableau.extra
    weights = tableau.dense
    degree = weights.shape[1]
    for i in range(first, last + 1):
        for m in range(degree):
            total = 0.0
            for j in range(n):
                total += weights[j, m] * k[j, i]
            dense[i, m] = h * total


@kernel
def dense_at(y, dense, degree, component, s):
    """State component at share `s` of the step."""
    value = dense[component, degree - 1]
    for m in range(degree - 2, -1, -1):
        value = value * s + dense[component, m]
    return y[component] + value * s
