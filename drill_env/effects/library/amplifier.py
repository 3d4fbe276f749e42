"""Between the voltage that is asked for and the motor."""

from functools import partial
from math import pi

from drill_env.effects._effect import amplitude, effect, shape
from drill_env.effects.signal import at_start, clipped, size_of

actuator = partial(effect, "actuator")

_LAGS = (0.004, 0.008, 0.015, 0.03, 0.05, 0.08, 0.12, 0.2, 0.3, 0.5)
_DELAYS = (0.01, 0.015, 0.02, 0.03, 0.04, 0.06, 0.08, 0.12, 0.16, 0.2, 0.3)
_RINGING = (0.5, 1.0, 2.0, 3.5, 6.0, 10.0, 18.0, 30.0)
_RATES = (2.0, 4.0, 7.0, 10.0, 15.0, 20.0, 30.0, 45.0, 70.0, 100.0, 150.0, 250.0, 400.0)
_WIDTHS = (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0)
_LEVELS = (
    0.6, 0.8, 1.0, 1.25, 1.5, 1.75, 2.0, 2.25, 2.5, 2.75, 3.0, 3.25, 3.5, 3.75, 4.0, 4.25, 4.5,
    4.75, 4.9,
)  # fmt: skip


@actuator(
    "voltage",
    "The motor's torque follows the voltage with a lag.",
    shape("time_constant", "s", _LAGS, low=0.0001, high=20.0),
    states=1,
    neighbours=("input_delay", "slew_limit", "drive_resonance", "gear_compliance"),
)
def actuator_lag(p, e, s, out):
    """km (v - u), time_constant dv/dt = u - v."""
    if s.first:
        e.z[0] = at_start(s)
    out.volts += e.z[0] - s.u
    e.rate[0] = (s.u - e.z[0]) / e.q[0]


@actuator(
    "voltage",
    "The motor's torque follows the voltage as a spring would, with overshoot, such as behind a "
    "filter or a controller of its current.",
    shape("frequency", "Hz", _RINGING, low=0.05, high=500.0, form=0.0),
    shape("damping", "1", (0.15, 0.4, 1.0), low=0.001, high=5.0),
    formula="km (v - u), d2v/dt2 = w^2 (u - v) - 2 damping w dv/dt, w = 2 pi frequency",
    states=2,
    neighbours=("actuator_lag", "input_delay", "upper_resonator"),
)
def drive_resonance(p, e, s, out):
    """km (v - u), d2v/dt2 = w^2 (u - v) - 2 damping w dv/dt, w = 2 pi frequency."""
    if s.first:
        e.z[0] = at_start(s)
    out.volts += e.z[0] - s.u
    wave = 2.0 * pi * e.q[0]
    # The rate is kept in volts, as large as the voltage itself whatever the frequency.
    e.rate[0] = wave * e.z[1]
    e.rate[1] = wave * (s.u - e.z[0] - 2.0 * e.q[1] * e.z[1])


@actuator(
    "voltage",
    "The amplifier ignores small voltages.",
    shape("width", "V", _WIDTHS, low=0.0001, high=10000.0),
    switches=2,
    neighbours=("upper_stribeck", "gear_backlash"),
)
def amplifier_deadzone(p, e, s, out):
    """-km clip(u, -width, width)."""
    out.volts -= clipped(e, s, 0, s.u, -e.q[0], e.q[0])


@actuator(
    "voltage",
    "The amplifier delivers no more than a limit.",
    shape("level", "V", _LEVELS, low=0.001, high=100000.0),
    switches=2,
    neighbours=("supply_sag", "slew_limit"),
)
def amplifier_saturation(p, e, s, out):
    """km (clip(u, -level, level) - u)."""
    out.volts += clipped(e, s, 0, s.u, -e.q[0], e.q[0]) - s.u


@actuator(
    "voltage",
    "The bridge is off at u = 0, so that the motor coasts: no current, and none of its braking.",
    amplitude("back_emf", "V s/rad", 0.2, most=1e4, signed=False),
    neighbours=("drive_braking_loss", "amplifier_deadzone"),
)
def coasting(p, e, s, out):
    """km back_emf omega_u where u = 0: the part of bu omega_u that the current makes."""
    if s.u.real == 0.0:
        out.volts += e.q[0] * s.omega_u


@actuator(
    "voltage",
    "The drive limits its current, and the motor's torque with it.",
    shape("level", "V", (0.6, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5), low=0.001, high=100000.0),
    shape("back_emf", "V s/rad", (0.25, 0.5), low=0.0, high=10000.0),
    switches=2,
    neighbours=("amplifier_saturation", "supply_sag", "motor_heating"),
)
def current_limit(p, e, s, out):
    """km (clip(v, -level, level) - v), v = u - back_emf omega_u."""
    left = s.u - e.q[1] * s.omega_u
    out.volts += clipped(e, s, 0, left, -e.q[0], e.q[0]) - left


@actuator(
    "voltage",
    "The drive is stronger in one direction.",
    amplitude("asymmetry", "1", 0.02, most=0.9),
    switches=1,
    neighbours=("upper_quadratic_drag",),
)
def gain_asymmetry(p, e, s, out):
    """km asymmetry |u|."""
    out.volts += e.q[0] * size_of(e, s, 0, s.u)


@actuator(
    "voltage",
    "The voltage acts late.",
    shape("delay", "s", _DELAYS, low=0.0, high=0.5),
    delay="delay",
    neighbours=("actuator_lag", "slew_limit"),
    aliases=("encoder_delay_both",),
    passing=True,
)
def input_delay(p, e, s, out):
    """km (u(t - delay) - u(t))."""
    out.volts += e.u_late - s.u


# So near, in V, it has arrived: a voltage that begins at 0 begins there but for rounding.
_REACHED = 1e-9
# Where no event is located it has arrived when so many seconds would do.
_SOON = 5e-3


@actuator(
    "voltage",
    "The amplifier changes its voltage no faster than a limit.",
    shape("rate", "V/s", _RATES, low=0.001, high=1e7),
    states=1,
    switches=1,
    neighbours=("actuator_lag", "input_delay"),
    passing=True,
)
def slew_limit(p, e, s, out):
    """km (v - u), |dv/dt| <= rate, v follows u."""
    if s.first:
        e.z[0] = at_start(s)
    gap = s.u - e.z[0]
    if s.choose and s.first:
        e.side[0] = 0 if abs(gap) <= _REACHED else (1 if gap.real > 0.0 else -1)
    if s.choose and (e.side[0] * gap).real <= 0.0:
        e.side[0] = 1 if gap.real > 0.0 else -1
        if abs(gap) <= e.q[0].real * _SOON:
            e.side[0] = 0
            e.z[0] = s.u
            gap = 0.0 * gap
    if e.side[0] != 0:
        e.gap[0], e.next[0] = e.side[0] * gap, 0
        e.rate[0] = e.side[0] * e.q[0]
        out.volts -= gap
    else:
        e.rate[0] = s.u_rate
        if s.settle and abs(gap) <= _REACHED:
            e.z[0], gap = s.u, 0.0 * gap
        # It follows until the voltage jumps or runs away.
        jumped, rising = abs(gap) > _REACHED, s.u_rate.real > 0.0
        e.gap[0] = -1.0 if jumped else e.q[0] - abs(s.u_rate)
        e.next[0] = 1 if (gap.real > 0.0 if jumped else rising) else -1


@actuator(
    "voltage",
    "The drive gives way little by little as it comes to its limit, as iron saturates.",
    shape("level", "V", (1.0, 2.0, 3.0, 4.0, 5.0), low=0.001, high=100000.0),
    shape("softness", "1", (0.5, 0.2), low=0.02, high=2.0),
    switches=1,
    neighbours=("amplifier_saturation", "supply_sag"),
    limit=("softness", "amplifier_saturation"),
)
def soft_saturation(p, e, s, out):
    """km (u/(1 + |u/level|^(1/softness))^softness - u)."""
    size = size_of(e, s, 0, s.u) / e.q[0]
    # At 0 the power has no complex derivative, and there is nothing to add.
    if size.real > 0.0:
        out.volts += s.u / (1.0 + size ** (1.0 / e.q[1])) ** e.q[1] - s.u


@actuator(
    "voltage",
    "The supply gives way under load.",
    amplitude("sag", "1/V", 0.01, most=0.19, signed=False),
    switches=1,
    neighbours=("amplifier_saturation", "upper_quadratic_drag"),
)
def supply_sag(p, e, s, out):
    """-km sag |u| u."""
    out.volts -= e.q[0] * size_of(e, s, 0, s.u) * s.u
