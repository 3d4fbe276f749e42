"""Compiled equations of motion (4) with one vector field per slip/stick mode.

State: twist = theta_u - theta_l (rad), omega_u, omega_l (rad/s), theta_l (rad).
Mode: (upper, lower) slip directions -1, 0 (stuck), 1, and the speed range of the lower law
(1 where it is clamped to zero). `load_u` and `load_l` are external torques (Nm) on the discs,
0 but where the identification estimates them.
"""

from drill_env._intrinsics import fma
from drill_env._jit import entry, inlined, kernel
from drill_env.friction.kernels import (
    gradient_of,
    lower_slope,
    shares,
    sliding_of,
    slope_of,
    upper_sliding,
)
from drill_env.parameters.record import (
    BU,
    DBU,
    DTSU,
    JL,
    JU,
    KM,
    KTHETA,
    N_PARAMETERS,
    TSL,
    TSU,
)

# Of a sum of four products: as many units in the last place.
ROUNDING = 4.0 * 2.0**-52


@inlined
def upper_rate(p, upper, twist, omega_u, u):
    """Upper-disc acceleration (rad/s^2) in slip direction `upper`, 0 when stuck."""
    if upper == 0:
        return 0.0
    drive = (p.km * u + p.load_u - p.ktheta * twist) * p.per_Ju
    return fma(-p.per_Ju, upper_sliding(p, upper, omega_u), drive)


@inlined
def lower_rate(p, lower, clamped, twist, omega_l):
    """Lower-disc acceleration (rad/s^2) in slip direction `lower`, 0 when stuck."""
    return lower_rate_with(p, lower, clamped, twist, omega_l)[0]


@entry
def rates_at(p, mode, twist, omega_u, omega_l, u):
    """Accelerations (rad/s^2) of the upper and the lower disc in the modes `mode`."""
    return upper_rate(p, mode[0], twist, omega_u, u), lower_rate(
        p, mode[1], mode[2], twist, omega_l
    )


@inlined
def lower_rate_with(p, lower, clamped, twist, omega_l):
    """As `lower_rate`, with the shares of the friction law that it took."""
    if lower == 0:
        return 0.0, 0.0, 0.0
    s1, s2, torque = 0.0, 0.0, 0.0
    if clamped != 1:
        s1, s2 = shares(p, lower * omega_l)
        torque = sliding_of(p, lower * omega_l, s1, s2)
    drive = (p.ktheta * twist + p.load_l) * p.per_Jl
    return fma(-lower * p.per_Jl, torque, drive), s1, s2


@inlined
def upper_margin(p, twist, u):
    """Stiction left at the upper disc (Nm), and the sign it would leave in."""
    drive = p.km * u + p.load_u - p.ktheta * twist - p.dTsu
    # A voltage that just holds does so whichever way its sum is rounded.
    stiction = p.Tsu + ROUNDING * (p.Tsu + abs(p.km * u) + abs(p.ktheta * twist) + abs(p.dTsu))
    return (stiction - drive, 1) if drive >= 0.0 else (stiction + drive, -1)


@inlined
def lower_margin(p, twist):
    """Stiction left at the lower disc (Nm), and the sign it would leave in."""
    drive = p.ktheta * twist + p.load_l
    return (p.Tsl - drive, 1) if drive >= 0.0 else (p.Tsl + drive, -1)


@kernel
def upper_event(p, upper, twist, omega_u, omega_l, acceleration, u, du):
    """Upper-disc event function and its time derivative; the mode ends where it turns negative."""
    if upper != 0:
        return upper * omega_u, upper * acceleration
    margin, sign = upper_margin(p, twist, u)
    return margin, -sign * (p.km * du - p.ktheta * (omega_u - omega_l))


@kernel
def lower_event(p, lower, twist, omega_u, omega_l, acceleration):
    """Lower-disc event function and its time derivative; the mode ends where it turns negative."""
    if p.locked:
        return 1.0, 0.0
    if lower != 0:
        return lower * omega_l, lower * acceleration
    margin, sign = lower_margin(p, twist)
    return margin, -sign * p.ktheta * (omega_u - omega_l)


@kernel
def clamp_event(p, lower, clamped, omega_l, acceleration):
    """Event function of the clamped law: where the speed leaves its present range.

    The range is 0 below the clamped speeds, 1 among them and 2 above.
    """
    if not p.clamp or lower == 0:
        return 1.0, 0.0
    speed, rate = lower * omega_l, lower * acceleration
    if clamped == 0:
        return p.clamp_low - speed, -rate
    if clamped == 2 or speed - p.clamp_low < p.clamp_high - speed:
        edge = p.clamp_high if clamped == 2 else p.clamp_low
        return speed - edge, rate
    return p.clamp_high - speed, -rate


@inlined
def lower_rate_slope(p, lower, clamped, s1, s2):
    """Derivative of the lower disc's acceleration by its speed, 1/s, from the law's shares."""
    return 0.0 if lower == 0 or clamped == 1 else -slope_of(p, s1, s2) * p.per_Jl


@entry
def fill_jacobian(p, upper, lower, clamped, omega_l, jac):
    """Non-zero entries of d(rates)/d(twist, omega_u, omega_l): `jac` = (u_x, u_u, l_x, l_l)."""
    fill_linear(p, upper, lower, jac)
    jac[3] = 0.0
    if lower != 0 and clamped != 1:
        jac[3] = -lower_slope(p, lower * omega_l) * p.per_Jl


@inlined
def fill_linear(p, upper, lower, jac):
    """Those entries of `fill_jacobian` that no speed changes: all but the last."""
    jac[0] = jac[1] = jac[2] = 0.0
    if upper != 0:
        jac[0] = -p.ktheta * p.per_Ju
        jac[1] = -(p.bu + upper * p.dbu) * p.per_Ju
    if lower != 0:
        jac[2] = p.ktheta * p.per_Jl


@kernel
def fill_parameter_rates(
    p, upper, lower, clamped, twist, omega_u, omega_l, u, rate_u, rate_l, s1, s2, out_u, out_l
):
    """Derivatives of both accelerations by the fourteen parameters.

    The accelerations `rate_u` and `rate_l` and the shares `s1` and `s2` of the lower law are known.
    """
    for i in range(N_PARAMETERS):
        out_u[i] = 0.0
        out_l[i] = 0.0
    if upper != 0:
        out_u[KM] = u * p.per_Ju
        out_u[JU] = -rate_u * p.per_Ju
        out_u[KTHETA] = -twist * p.per_Ju
        out_u[TSU] = -upper * p.per_Ju
        out_u[DTSU] = -p.per_Ju
        out_u[BU] = -omega_u * p.per_Ju
        out_u[DBU] = -upper * omega_u * p.per_Ju
    if lower == 0:
        return
    if clamped != 1:
        gradient_of(p, lower * omega_l, s1, s2, out_l)
        for i in range(TSL, N_PARAMETERS):
            out_l[i] *= -lower * p.per_Jl
    out_l[JL] = -rate_l * p.per_Jl
    out_l[KTHETA] = twist * p.per_Jl
