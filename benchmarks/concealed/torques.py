"""Torques of the plant and of everything that may be concealed in it (compiled)."""

import math

from numba import njit

from benchmarks.concealed.fields import (
    AGE,
    ANCHOR,
    BEND,
    CREEP,
    DRIVE,
    FACTOR_L,
    FACTOR_U,
    HOLD,
    HYST,
    LAGGED,
    MESH_STIFFNESS,
    NOISE_L,
    NOISE_U,
    TH_L,
    TH_M,
    TH_S,
    TH_U,
    W_L,
    W_M,
    W_S,
    W_U,
)


@njit(cache=True)
def humped(q, v):
    """Equation (7)."""
    first = math.tanh(0.5 * q.beta1 * v)
    return q.Tsl + q.T1 * first + q.T2 * math.tanh(0.5 * q.beta2 * v) + q.bl * v


@njit(cache=True)
def _bump(angle, centre):
    """A hard spot 0.25 rad wide at one angle of a turn."""
    turn = 2.0 * math.pi
    away = angle - centre - turn * math.floor((angle - centre) / turn + 0.5)
    return math.exp(-0.5 * (away / 0.25) ** 2)


@njit(cache=True)
def _play(x, half):
    if x > half:
        return x - half
    if x < -half:
        return x + half
    return 0.0


@njit(cache=True)
def _signed_power(x, power):
    # Of a speed that passes through zero within a step too.
    return math.copysign(abs(x) ** power, x)


@njit(cache=True)
def _pull(q, x, rate, hysteresis):
    """Torque of the string at a twist and its rate."""
    d = _play(x, q.play)
    k = q.ktheta * (1.0 + q.string_asymmetry * math.copysign(1.0, d))
    viscous = q.cubic_damping * rate**3
    if q.damping != 0.0:
        viscous += q.damping * _signed_power(rate, q.damping_power)
    more = 0.0
    if q.hardening != 0.0:
        more += q.hardening * _signed_power(d, q.hardening_power)
    if q.stiffening != 0.0:
        more += q.stiffening * _play(d, q.stiffening_from)
    return k * (d + more) + viscous + q.hysteresis * hysteresis


@njit(cache=True)
def _string(q, x):
    """Torque that the string takes from the upper disc, and gives to the lower one."""
    if q.string_inertia > 0.0:
        loss = 0.002 * math.sqrt(4.0 * q.ktheta * q.string_inertia)
        top = _pull(q, 2.0 * (x[TH_U] - x[TH_S]) - x[CREEP], 2.0 * (x[W_U] - x[W_S]), x[HYST])
        low = _pull(q, 2.0 * (x[TH_S] - x[TH_L]) - x[CREEP], 2.0 * (x[W_S] - x[W_L]), x[HYST])
        return top + loss * (x[W_U] - x[W_S]), low + loss * (x[W_S] - x[W_L])
    torque = _pull(q, x[TH_U] - x[TH_L] - x[CREEP], x[W_U] - x[W_L], x[HYST])
    return torque, torque


@njit(cache=True)
def geared(q):
    """Whether the motor has an inertia of its own."""
    return q.gap > 0.0 or q.compliance > 0.0


@njit(cache=True)
def _mesh(q, x):
    """Torque through the gear between a motor and a disc that move apart."""
    stiffness = MESH_STIFFNESS if q.gap > 0.0 else 1.0 / q.compliance
    d = _play(x[TH_M] - x[TH_U], 0.5 * q.gap)
    if q.gap > 0.0 and d == 0.0:
        return 0.0
    reduced = q.motor_share * (1.0 - q.motor_share) * q.Ju
    ratio = 0.3 if q.gap > 0.0 else 0.05
    torque = stiffness * d + 2.0 * ratio * math.sqrt(stiffness * reduced) * (x[W_M] - x[W_U])
    # Teeth push and never pull.
    return torque if q.gap == 0.0 or torque * d > 0.0 else 0.0


@njit(cache=True)
def loads(q, x, a):
    """Torques on the discs without their friction, the string's on top and through the gear."""
    top, low = _string(q, x)
    gear = a[DRIVE]
    if geared(q):
        gear = _mesh(q, x)
    elif q.gear_eccentricity != 0.0:
        gear *= 1.0 + q.gear_eccentricity * math.cos(x[TH_U] + q.gear_phase)
    upper = gear - top + a[NOISE_U]
    if q.ripple != 0.0:
        upper += q.ripple * math.sin(q.ripple_order * x[TH_U] + q.ripple_phase)
    lower = low + a[NOISE_L]
    if q.unbalance != 0.0:
        lower += q.unbalance * math.sin(x[TH_L] + q.unbalance_phase)
    return upper, lower, top, low, gear


@njit(cache=True)
def upper_friction(q, x, a, s, w, top):
    """Friction of the upper disc against direction `s` at speed `w` >= 0."""
    dry = q.Tsu + s * q.dTsu + (q.bu + s * q.dbu) * w
    if q.upper_stribeck != 0.0:
        share = w / q.upper_stribeck_speed
        dry += q.upper_stribeck * math.exp(-_signed_power(share, q.upper_stribeck_power))
    if q.rational_stribeck != 0.0:
        dry += q.rational_stribeck / (1.0 + w / q.rational_stribeck_speed)
    if q.tooth != 0.0:
        dry *= 1.0 + q.tooth * _bump(x[TH_U], q.tooth_angle)
    wet = 0.0
    if q.upper_drag != 0.0:
        wet += q.upper_drag * _signed_power(w, q.upper_drag_power)
    if q.load_friction != 0.0:
        wet += q.load_friction * abs(top) ** q.load_power
    return dry * a[FACTOR_U] + wet


@njit(cache=True)
def _whirl(q, w):
    """Drag of a disc that whirls: its orbit grows towards a critical speed."""
    r = w / q.whirl_speed
    orbit = r**4 / ((1.0 - r * r) ** 2 + (2.0 * q.whirl_damping * r) ** 2)
    return q.whirl * orbit * w / q.whirl_speed


@njit(cache=True)
def lower_friction(q, x, a, s, w):
    """Friction of the lower disc against direction `s` at speed `w` >= 0."""
    v = x[LAGGED] if q.friction_lag > 0.0 else w
    dry = humped(q, v)
    if q.lower_stribeck != 0.0:
        share = v / q.lower_stribeck_speed
        dry += q.lower_stribeck * math.exp(-_signed_power(share, q.lower_stribeck_power))
    if q.state_torque != 0.0:
        aged = math.log(1.0 + q.state_speed * x[AGE] / q.state_distance)
        dry += q.state_torque * (0.5 * math.log(1.0 + w / q.state_speed) + aged)
    dry *= a[FACTOR_L] * (1.0 + s * q.lower_asymmetry)
    if q.runout != 0.0:
        dry *= 1.0 + q.runout * math.cos(x[TH_L] + q.runout_phase)
    if q.spot != 0.0:
        dry *= 1.0 + q.spot * _bump(x[TH_L], q.spot_angle)
    if q.whirl != 0.0:
        dry += _whirl(q, w)
    if q.lower_drag != 0.0:
        dry += q.lower_drag * _signed_power(w, q.lower_drag_power)
    return dry


@njit(cache=True)
def bend(q, x, way):
    """Dahl's bristles since the last reversal, -1 to 1 of what they bear."""
    left, run = way - x[BEND], abs(x[TH_L] - x[ANCHOR]) / q.presliding
    over = q.presliding_power - 1.0
    if over == 0.0:
        return way - left * math.exp(-run)
    # d|left|/drun = -|left|^power.
    return way - left * (1.0 + over * abs(left) ** over * run) ** (-1.0 / over)


@njit(cache=True)
def margin(q, x, s, a, disc):
    """Falls below zero where the disc's mode ends: its speed against its direction, or its hold."""
    row = W_U if disc == 0 else W_L
    if s[disc] != 0:
        return s[disc] * x[row]
    upper, lower, top, _, _ = loads(q, x, a)
    if disc == 0:
        forward = upper_friction(q, x, a, 1.0, 0.0, top) - upper
        backward = upper_friction(q, x, a, -1.0, 0.0, top) + upper
    else:
        forward = lower_friction(q, x, a, 1.0, 0.0) + a[HOLD] - lower
        backward = lower_friction(q, x, a, -1.0, 0.0) + a[HOLD] + lower
    return min(forward, backward)


@njit(cache=True)
def rates(q, x, s, a, out):
    """Right-hand side in the slip directions `s`; a disc with direction 0 is stuck."""
    upper, lower, top, low, gear = loads(q, x, a)
    inertia = q.Ju * (1.0 - q.motor_share) if geared(q) else q.Ju
    out[TH_U], out[TH_L] = x[W_U], x[W_L]
    out[W_U] = out[W_L] = 0.0
    if s[0] != 0:
        out[W_U] = (upper - s[0] * upper_friction(q, x, a, s[0], s[0] * x[W_U], top)) / inertia
    speed = abs(x[W_L])
    if s[1] != 0:
        brake = s[1] * lower_friction(q, x, a, s[1], s[1] * x[W_L])
        if q.presliding > 0.0:
            brake = bend(q, x, s[1]) * lower_friction(q, x, a, s[1], s[1] * x[W_L])
        out[W_L] = (lower - brake) / q.Jl
    if geared(q):
        out[TH_M], out[W_M] = x[W_M], (a[DRIVE] - gear) / (q.motor_share * q.Ju)
    if q.string_inertia > 0.0:
        out[TH_S], out[W_S] = x[W_S], (top - low) / q.string_inertia
    if q.hysteresis != 0.0:
        rate = x[W_U] - x[W_L]
        loss = abs(x[HYST]) ** q.hysteresis_power * (0.5 + math.copysign(0.5, rate * x[HYST]))
        out[HYST] = rate / q.hysteresis_width * (1.0 - loss)
    if q.creep != 0.0:
        out[CREEP] = (q.creep * (x[TH_U] - x[TH_L]) - x[CREEP]) / q.creep_tau
    if q.friction_lag > 0.0:
        out[LAGGED] = (speed - x[LAGGED]) / q.friction_lag
    if q.state_torque != 0.0:
        out[AGE] = 1.0 - speed * x[AGE] / q.state_distance
