"""Torques on the lower disc that are no friction of its brake."""

from functools import partial
from math import pi, sqrt

from numpy import cos

from drill_env.effects._effect import HEAVIEST, amplitude, effect, phase, shape
from drill_env.effects.library.upper_torques import FREQUENCY, RESONATOR, same_body, swing
from drill_env.effects.signal import branch

lower = partial(effect, "lower")


@lower(
    "time",
    "Something outside shakes the lower disc at a fixed frequency.",
    amplitude("torque", "Nm", 0.0005, most=HEAVIEST, signed=False),
    phase(),
    FREQUENCY,
    swings="frequency",
)
def lower_disturbance(p, e, s, out):
    """torque cos(2 pi frequency t + phase)."""
    out.torque_l += e.q[0] * cos(2.0 * pi * e.q[2] * s.t + e.q[1])


@lower(
    "omega_l",
    "A body on a spring, such as a frame, swings at the lower disc.",
    *RESONATOR,
    formula="share Jl (w^2 z + 2 damping w dz/dt), "
    "d2z/dt2 = -w^2 z - 2 damping w dz/dt - domega_l/dt, w = 2 pi frequency",
    states=2,
    neighbours=("string_inertia", "string_damping"),
    heavier=same_body,
)
def lower_resonator(p, e, s, out):
    """share Jl (w^2 z + 2 damping w dz/dt), d2z/dt2 = -w^2 z - 2 damping w dz/dt - domega_l/dt."""
    out.torque_l += swing(e, s, s.omega_l, p.Jl)


@lower(
    "omega_l",
    "The lower disc meets a drag that grows with the square of its speed.",
    amplitude("coefficient", "Nm s^2/rad^2", 5e-05, most=HEAVIEST, signed=False),
    neighbours=("whirl_drag", "lower_stribeck"),
)
def quadratic_drag(p, e, s, out):
    """-coefficient |omega_l| omega_l."""
    out.torque_l -= e.q[0] * s.side_l * s.omega_l * s.omega_l


@lower(
    "time",
    "Something struck the lower disc at one moment.",
    amplitude("torque", "Nm", 0.005, most=HEAVIEST),
    shape("time", "s", tuple(2.0 * k for k in range(1, 30)), low=0.0, high=100000.0, form=0.0),
    shape("duration", "s", (0.2, 0.5, 1.5), low=0.01, high=100.0),
    switches=2,
    neighbours=("friction_step",),
)
def torque_pulse(p, e, s, out):
    """torque from time to time + duration."""
    begun, ended = branch(e, s, 0, s.t - e.q[1]), branch(e, s, 1, s.t - e.q[1] - e.q[2])
    if begun > 0 and ended < 0:
        out.torque_l += e.q[0]


@lower(
    "theta_l",
    "The lower disc is out of balance.",
    amplitude("torque", "Nm", 0.002, most=HEAVIEST, signed=False),
    phase(),
    neighbours=("encoder_eccentricity_lower", "brake_runout"),
)
def unbalance(p, e, s, out):
    """torque cos(theta_l + phase)."""
    out.torque_l += e.q[0] * cos(s.theta_l + e.q[1])


@lower(
    "omega_l",
    "Near a critical speed the string whirls, and its orbit drags.",
    amplitude("torque", "Nm", 0.0005, most=HEAVIEST, signed=False),
    shape("speed", "rad/s", (3.0, 5.0, 6.5, 8.0, 10.0, 13.0), low=0.2, high=10000.0),
    # Damped more, no critical speed shows: a second-order system has a peak below 1/sqrt(2) alone.
    shape("damping", "1", (0.15, 0.4), low=0.02, high=sqrt(0.5)),
    neighbours=("quadratic_drag",),
    source="Jeffcott rotor, drag with the square of the orbit; Jansen, J. Sound Vib. 147 (1991)",
)
def whirl_drag(p, e, s, out):
    """-torque r^5/((1 - r^2)^2 + (2 damping r)^2), r = omega_l/speed."""
    r = s.omega_l / e.q[1]
    square = r * r
    apart, loss = 1.0 - square, 2.0 * e.q[2] * r
    out.torque_l -= e.q[0] * r * square * square / (apart * apart + loss * loss)
