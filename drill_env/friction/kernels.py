"""Compiled friction laws: sliding torque, its slope and its parameter derivatives.

`speed` is the speed along the slip direction, positive while slipping. The laws
continue smoothly to small negative values so that an integrator step may reach past
zero before the event is located.
"""

from math import exp, inf

from drill_env._intrinsics import fma
from drill_env._jit import entry, inlined, kernel
from drill_env.friction._tanh_half import tanh_half
from drill_env.parameters.record import BETA1, BETA2, BL, HUMPED, STRIBECK, T1, T2, TSL


@inlined
def shares(p, speed):
    """What the two bent terms of a law have reached, from 0 at rest to 1; all else follows."""
    if p.law == HUMPED:
        return tanh_half(p.beta1 * speed), tanh_half(p.beta2 * speed)
    if p.law == STRIBECK:
        return 1.0 - exp(-p.beta1 * speed), 0.0
    return 0.0, 0.0


@inlined
def sliding_of(p, speed, s1, s2):
    """Lower-disc sliding torque T_l (Nm) from its shares, equation (7) or its alternatives."""
    return fma(p.T1, s1, fma(p.bl, speed, p.Tsl)) + p.T2 * s2


@inlined
def slope_of(p, s1, s2):
    """dT_l/d(speed) (Nm s/rad) from the shares."""
    if p.law == HUMPED:
        return p.bl + 0.5 * (p.T1 * p.beta1 * (1.0 - s1 * s1) + p.T2 * p.beta2 * (1.0 - s2 * s2))
    if p.law == STRIBECK:
        return p.bl + p.T1 * p.beta1 * (1.0 - s1)
    return p.bl


@inlined
def gradient_of(p, speed, s1, s2, out):
    """Fill `out[TSL..BL]` with the derivatives of T_l by its parameters, from the shares."""
    out[TSL] = 1.0
    out[BL] = speed
    out[T1] = s1
    out[T2] = s2
    out[BETA1] = out[BETA2] = 0.0
    if p.law == HUMPED:
        out[BETA1] = 0.5 * p.T1 * (1.0 - s1 * s1) * speed
        out[BETA2] = 0.5 * p.T2 * (1.0 - s2 * s2) * speed
    elif p.law == STRIBECK:
        out[BETA1] = p.T1 * speed * (1.0 - s1)


@inlined
def lower_sliding(p, speed):
    """Lower-disc sliding torque T_l (Nm)."""
    s1, s2 = shares(p, speed)
    return sliding_of(p, speed, s1, s2)


@inlined
def lower_size(p, speed):
    """Size (Nm) of the lower disc's own friction, never negative where the law is clamped."""
    torque = lower_sliding(p, speed)
    return max(torque, 0.0) if p.clamp else torque


@inlined
def lower_slope(p, speed):
    """dT_l/d(speed) (Nm s/rad)."""
    s1, s2 = shares(p, speed)
    return slope_of(p, s1, s2)


@kernel
def torque_root(p, positive, negative):
    """Speed between `positive` and `negative` where T_l changes sign (bisection)."""
    for _ in range(60):
        middle = 0.5 * (positive + negative)
        if lower_sliding(p, middle) >= 0.0:
            positive = middle
        else:
            negative = middle
    return positive


@entry
def fill_clamp(p):
    """Speeds between which T_l is negative, infinite where it never is up to 400 rad/s."""
    p.clamp_low = p.clamp_high = inf
    step = 0.02
    for i in range(1, 20_001):
        speed = i * step
        negative = lower_sliding(p, speed) < 0.0
        if negative and p.clamp_low == inf:
            p.clamp_low = torque_root(p, speed - step, speed)
        elif p.clamp_low < inf and not negative:
            p.clamp_high = torque_root(p, speed, speed - step)
            return


@inlined
def upper_sliding(p, sign, omega):
    """Signed upper friction torque T_fu (Nm) while slipping in direction `sign`, (5)."""
    return fma(p.bu + sign * p.dbu, omega, sign * p.Tsu + p.dTsu)


@entry
def map_lower(p, speeds, slope, out):
    """T_l, or its slope, at many speeds."""
    for i in range(speeds.size):
        out[i] = lower_slope(p, speeds[i]) if slope else lower_sliding(p, speeds[i])


@entry
def map_upper(p, omegas, out):
    """T_fu at many velocities."""
    for i in range(omegas.size):
        out[i] = upper_sliding(p, 1.0 if omegas[i] > 0.0 else -1.0, omegas[i])
