"""The motor: its torque constant and its ripple."""

from functools import partial

from numpy import cos, exp

from drill_env.effects._effect import HEAVIEST, amplitude, effect, phase, shape
from drill_env.effects.signal import branch

actuator = partial(effect, "actuator")

ORDERS = (
    2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 14.0, 15.0, 16.0, 18.0, 20.0, 21.0,
    22.0, 24.0, 27.0, 28.0, 30.0, 32.0, 33.0, 36.0, 40.0, 44.0, 48.0,
)  # fmt: skip
"""Cycles a turn that motors have."""


@actuator(
    "theta_u",
    "The motor's torque constant changes with its angle, as the current is commutated.",
    amplitude("depth", "1", 0.02, most=0.9, signed=False),
    phase(),
    shape("order", "1", ORDERS, low=1.5, high=500.0, form=0.0),
    neighbours=("gear_eccentricity", "torque_ripple"),
)
def commutation_ripple(p, e, s, out):
    """km u depth cos(order theta_u + phase)."""
    out.volts += s.u * e.q[0] * cos(e.q[2] * s.theta_u + e.q[1])


@actuator(
    "voltage",
    "The motor gives less torque, or more, where it brakes than where it drives.",
    amplitude("loss", "1", 0.05, most=0.9),
    switches=1,
    neighbours=("upper_load_friction", "gain_asymmetry"),
)
def drive_braking_loss(p, e, s, out):
    """-km loss u where u omega_u < 0."""
    # The integrator itself ends a step where the disc stops or turns back.
    if branch(e, s, 0, s.u) * s.side_u < 0.0:
        out.volts -= e.q[0] * s.u


@actuator(
    "omega_u",
    "The motor gives less torque the faster it turns, as its field is weakened.",
    amplitude("loss", "s/rad", 0.02, most=1000.0, signed=False),
    switches=1,
    neighbours=("upper_viscous", "upper_quadratic_drag", "supply_sag"),
)
def drive_speed_loss(p, e, s, out):
    """-km u min(loss |omega_u|, 1)."""
    lost = e.q[0] * s.speed_u
    out.volts -= s.u * (lost if branch(e, s, 0, 1.0 - lost) > 0 else 1.0 + 0.0 * lost)


@actuator(
    "time",
    "The motor gets weaker, or stronger, after the start and settles.",
    amplitude("loss", "1", 0.05, most=0.9),
    shape("time_constant", "s", (3.0, 6.0, 12.0, 25.0, 50.0, 100.0), low=0.5, high=1000.0),
    neighbours=("motor_heating", "friction_warmup"),
    rigs_own_if_early=True,
)
def motor_fade(p, e, s, out):
    """-km loss (1 - e^(-t/time_constant)) u."""
    out.volts -= e.q[0] * (1.0 - exp(-s.t / e.q[1])) * s.u


@actuator(
    "time",
    "The motor loses torque as it warms.",
    amplitude("loss", "1", 0.05, most=0.9, signed=False),
    shape("time_constant", "s", (5.0, 10.0, 20.0, 40.0, 80.0, 200.0), low=2.0, high=10000.0),
    states=1,
    neighbours=("friction_warmup", "motor_fade"),
)
def motor_heating(p, e, s, out):
    """-km loss h u, time_constant dh/dt = u^2/(9 V^2) - h."""
    out.volts -= e.q[0] * e.z[0] * s.u
    e.rate[0] = (s.u * s.u / 9.0 - e.z[0]) / e.q[1]


@actuator(
    "theta_u",
    "The motor's torque ripples with its angle (cogging).",
    amplitude("torque", "Nm", 0.02, most=HEAVIEST, signed=False),
    phase(),
    shape("order", "1", ORDERS, low=1.5, high=500.0, form=0.0),
    neighbours=("gear_eccentricity",),
)
def torque_ripple(p, e, s, out):
    """torque cos(order theta_u + phase)."""
    out.torque_u += e.q[0] * cos(e.q[2] * s.theta_u + e.q[1])
