"""Torques on the upper disc that are no friction."""

from math import pi

from numpy import cos

from drill_env.effects._effect import HEAVIEST, amplitude, effect, phase, shape
from drill_env.effects._resonator import NUMBERS, swing


@effect(
    "upper",
    "time",
    "Something outside shakes the upper disc at a fixed frequency.",
    amplitude("torque", "Nm", 0.02, most=HEAVIEST, signed=False),
    phase(),
    shape(
        "frequency",
        "Hz",
        (0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.5, 6.5, 10.0, 15.0),
        low=0.005,
        high=200.0,
        form=0.0,
    ),
    swings="frequency",
    autonomous=False,
)
def upper_disturbance(p, e, s, out):
    """torque cos(2 pi frequency t + phase)."""
    out.torque_u += e.q[0] * cos(2.0 * pi * e.q[2] * s.t + e.q[1])


@effect(
    "upper",
    "time",
    "A constant torque acts on the upper disc, or its Coulomb friction differs with "
    "direction, which is the same.",
    amplitude("torque", "Nm", 0.02, most=HEAVIEST),
    neighbours=("upper_asymmetry", "gain_asymmetry"),
    stands_for="dTsu",
    common=True,
)
def upper_offset(p, e, s, out):
    """-torque."""
    out.torque_u -= e.q[0]


@effect(
    "upper",
    "omega_u",
    "A body on a spring, such as a frame, swings at the upper disc.",
    *NUMBERS,
    formula="share Ju (w^2 z + 2 damping w dz/dt), "
    "d2z/dt2 = -w^2 z - 2 damping w dz/dt - domega_u/dt, w = 2 pi frequency",
    states=2,
    neighbours=("gear_compliance", "string_inertia"),
)
def upper_resonator(p, e, s, out):
    """share Ju (w^2 z + 2 damping w dz/dt), d2z/dt2 = -w^2 z - 2 damping w dz/dt - domega_u/dt."""
    out.torque_u += swing(e, s, s.omega_u, p.Ju)


@effect(
    "upper",
    "theta_u",
    "A spring, a cable or a hose pulls the upper disc back.",
    amplitude("stiffness", "Nm/rad", 0.02, most=HEAVIEST, signed=False),
    shape("centre", "rad", (0.0,), low=-1000.0, high=1000.0, form=0.0),
    autonomous=False,
    neighbours=("upper_unbalance", "upper_offset"),
    axis_only=True,
)
def upper_spring(p, e, s, out):
    """-stiffness (theta_u - centre)."""
    out.torque_u -= e.q[0] * (s.theta_u - e.q[1])


@effect(
    "upper",
    "theta_u",
    "The upper disc, or what the axis carries, is out of balance (a pendulum).",
    amplitude("torque", "Nm", 0.02, most=HEAVIEST, signed=False),
    phase(),
    autonomous=False,
    neighbours=("encoder_eccentricity_upper", "gear_eccentricity", "upper_spring"),
    axis_only=True,
    common=True,
)
def upper_unbalance(p, e, s, out):
    """torque cos(theta_u + phase)."""
    out.torque_u += e.q[0] * cos(s.theta_u + e.q[1])
