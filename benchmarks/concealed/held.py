"""What stays the same over a substep of the plant: the amplifier, slow states, disturbances."""

import math

from numba import njit

from benchmarks.concealed.fields import (
    BRAKE_HEAT,
    DRIVE,
    DWELL,
    FACTOR_L,
    FACTOR_U,
    HOLD,
    NOISE_L,
    NOISE_U,
    SAGGED,
    SLEWED,
    SLID,
    VOLTS,
    W_L,
    WINDING,
)
from benchmarks.concealed.torques import lower_friction


@njit(cache=True)
def held_voltage(times, u, t, row):
    """Voltage that was held at time `t`, not later than that of row `row`."""
    while row >= 0 and times[row] > t:
        row -= 1
    return u[row] if row >= 0 else 0.0


@njit(cache=True)
def _slewed(x, v, move):
    """Mean over a substep of a voltage that moves by at most `move` in it, and its end."""
    start = x[SLEWED]
    gap = v - start
    if abs(gap) <= move:
        x[SLEWED] = v
        return v - 0.5 * gap * abs(gap) / move
    x[SLEWED] = start + math.copysign(move, gap)
    return start + 0.5 * math.copysign(move, gap)


@njit(cache=True)
def _lagged(x, row, goal, tau, h):
    """Mean over a substep of what follows `goal` with a lag, and its end."""
    start = x[row] - goal
    x[row] = goal + start * math.exp(-h / tau)
    return goal - start * math.expm1(-h / tau) * tau / h


@njit(cache=True)
def _warmed(x, goal, power, tau, h):
    """Mean over a substep of a winding that loses heat with a power of what it is warmed by."""
    start = x[WINDING]
    # A substep is so short beside `tau` that a straight line is exact enough.
    x[WINDING] = start + h / tau * (goal - start**power)
    return 0.5 * (start + x[WINDING])


@njit(cache=True)
def amplify(q, x, v, h):
    """Voltage that reaches the motor in the mean over a substep, from the commanded one."""
    if q.deadzone > 0.0:
        v -= min(max(v, -q.deadzone), q.deadzone)
    if q.slew_rate > 0.0:
        v = _slewed(x, v, q.slew_rate * h)
    if q.sag > 0.0:
        v *= 1.0 - q.sag * _lagged(x, SAGGED, abs(v), q.sag_tau, h)
    if q.voltage_limit > 0.0:
        v = min(max(v, -q.voltage_limit), q.voltage_limit)
    if q.tanh_limit > 0.0:
        v = q.tanh_limit * math.tanh(v / q.tanh_limit)
    if q.arctan_limit > 0.0:
        v = 2.0 / math.pi * q.arctan_limit * math.atan(0.5 * math.pi * v / q.arctan_limit)
    if q.lag > 0.0:
        v = _lagged(x, VOLTS, v, q.lag, h)
    return v


@njit(cache=True)
def hold(q, x, a, t, h, v, nu, nl):
    """Everything that stays the same over a substep from `t` s."""
    middle = t + 0.5 * h
    drive = q.km * v * (1.0 + q.gain_asymmetry * math.copysign(1.0, v))
    if q.heating != 0.0:
        if q.heating_power == 1.0:
            warm = _lagged(x, WINDING, v * v / 25.0, q.heating_tau, h)
        else:
            warm = _warmed(x, v * v / 25.0, q.heating_power, q.heating_tau, h)
        drive *= 1.0 - q.heating * warm
    a[DRIVE], a[NOISE_U], a[NOISE_L] = drive, nu, nl
    if q.upper_torque != 0.0:
        a[NOISE_U] += q.upper_torque * math.sin(
            2.0 * math.pi * q.upper_frequency * middle + q.upper_phase
        )
    if q.lower_torque != 0.0:
        a[NOISE_L] += q.lower_torque * math.sin(
            2.0 * math.pi * q.lower_frequency * middle + q.lower_phase
        )
    if q.pulse != 0.0 and 0.0 <= middle - q.pulse_time < q.pulse_width:
        a[NOISE_L] += q.pulse
    a[FACTOR_U] = 1.0
    if q.warmup != 0.0:
        a[FACTOR_U] += q.warmup * math.exp(-middle / q.warmup_tau)
    if q.rational_warmup != 0.0:
        a[FACTOR_U] += q.rational_warmup / (1.0 + middle / q.rational_warmup_time)
    a[FACTOR_L] = 1.0 + q.drift * middle / 60.0 - q.heat_fade * x[BRAKE_HEAT]
    if q.settling != 0.0:
        a[FACTOR_L] += q.settling * middle / (middle + q.settling_time)
    if q.step != 0.0 and middle >= q.step_time:
        a[FACTOR_L] += q.step
    if q.wear != 0.0:
        a[FACTOR_L] += q.wear * math.expm1(-x[SLID] / q.wear_distance)
    a[HOLD] = 0.0
    if q.dwell_torque != 0.0:
        a[HOLD] = -q.dwell_torque * math.expm1(-x[DWELL] / q.dwell_tau)


@njit(cache=True)
def remember(q, x, s, a, h):
    """Slow states after a substep."""
    x[DWELL] = x[DWELL] + h if s[1] == 0 else 0.0
    speed = abs(x[W_L])
    x[SLID] += h * speed
    if q.heat_fade != 0.0:
        power = speed * lower_friction(q, x, a, 1.0 if x[W_L] > 0 else -1.0, speed)
        _lagged(x, BRAKE_HEAT, power / 0.5, q.heat_tau, h)
