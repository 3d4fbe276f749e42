"""Torques on the upper disc that are no friction."""

from functools import partial
from math import pi

from numpy import cos

from drill_env._jit import kernel
from drill_env._types import FloatArray
from drill_env.effects._effect import HEAVIEST, amplitude, effect, phase, shape

upper = partial(effect, "upper")

FREQUENCY = shape(
    "frequency", "Hz", (0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.5, 6.5, 10.0, 15.0),
    low=0.005, high=200.0, form=0.0,
)  # fmt: skip
"""Of a disturbance from outside."""

_OWN = (0.3, 0.44, 0.64, 0.94, 1.4, 2.0, 3.0, 4.3, 6.4, 9.3, 14.0, 20.0)
RESONATOR = (
    shape("frequency", "Hz", _OWN, low=0.05, high=200.0, form=0.0),
    amplitude("share", "1", 0.05, most=5.0, signed=False),
    shape("damping", "1", (0.02,), low=0.0005, high=2.0),
)
"""The body's own frequency with the disc held, its share of the disc's inertia, and its damping."""


def same_body(q: FloatArray, times: float, share: int = 1) -> FloatArray:
    """A body's numbers on a disc of so many times the inertia: the body is the same.

    `share` is the place of its share of that inertia.
    """
    out = q.copy()
    out[share] = q[share] / times
    return out


@kernel
def swing(e, s, omega, inertia):
    """Torque (Nm) of the body on a disc of `inertia` that turns at `omega`.

    e.z[0] is the body's angle ahead of the disc, e.z[1] its own speed, so that no acceleration is
    asked for.
    """
    if s.first:
        e.z[1] = omega
    wave, slip = 2.0 * pi * e.q[0], e.z[1] - omega
    pull = wave * wave * e.z[0] + 2.0 * e.q[2] * wave * slip
    e.rate[0], e.rate[1] = slip, -pull
    return e.q[1] * inertia * pull


@upper(
    "time",
    "Something outside shakes the upper disc at a fixed frequency.",
    amplitude("torque", "Nm", 0.02, most=HEAVIEST, signed=False),
    phase(),
    FREQUENCY,
    swings="frequency",
)
def upper_disturbance(p, e, s, out):
    """torque cos(2 pi frequency t + phase)."""
    out.torque_u += e.q[0] * cos(2.0 * pi * e.q[2] * s.t + e.q[1])


@upper(
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


@upper(
    "omega_u",
    "A body on a spring, such as a frame, swings at the upper disc.",
    *RESONATOR,
    formula="share Ju (w^2 z + 2 damping w dz/dt), "
    "d2z/dt2 = -w^2 z - 2 damping w dz/dt - domega_u/dt, w = 2 pi frequency",
    states=2,
    neighbours=("gear_compliance", "string_inertia"),
    heavier=same_body,
)
def upper_resonator(p, e, s, out):
    """share Ju (w^2 z + 2 damping w dz/dt), d2z/dt2 = -w^2 z - 2 damping w dz/dt - domega_u/dt."""
    out.torque_u += swing(e, s, s.omega_u, p.Ju)


@upper(
    "theta_u",
    "A spring, a cable or a hose pulls the upper disc back.",
    amplitude("stiffness", "Nm/rad", 0.02, most=HEAVIEST, signed=False),
    shape("centre", "rad", (0.0,), low=-1000.0, high=1000.0, form=0.0),
    neighbours=("upper_unbalance", "upper_offset"),
    axis_only=True,
)
def upper_spring(p, e, s, out):
    """-stiffness (theta_u - centre)."""
    out.torque_u -= e.q[0] * (s.theta_u - e.q[1])


@upper(
    "theta_u",
    "The upper disc, or what the axis carries, is out of balance (a pendulum).",
    amplitude("torque", "Nm", 0.02, most=HEAVIEST, signed=False),
    phase(),
    neighbours=("encoder_eccentricity_upper", "gear_eccentricity", "upper_spring"),
    axis_only=True,
    common=True,
)
def upper_unbalance(p, e, s, out):
    """torque cos(theta_u + phase)."""
    out.torque_u += e.q[0] * cos(s.theta_u + e.q[1])
