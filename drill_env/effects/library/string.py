"""The string between the discs."""

from functools import partial
from math import pi

from drill_env.effects._effect import HEAVIEST, amplitude, effect, shape
from drill_env.effects.signal import clipped, size_of

string = partial(effect, "string")

_GAPS = (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.45, 0.6)
_FREQUENCIES = (
    0.503, 0.555, 0.612, 0.675, 0.745, 0.822, 0.907, 1.0, 1.103, 1.216, 1.341, 1.478, 1.63, 1.798,
    1.982, 2.186, 2.41, 2.658, 2.93, 3.231, 3.563, 3.929, 4.332, 4.777, 5.268, 5.809, 6.405, 7.063,
    7.788, 8.588, 9.47, 10.442, 11.514, 12.696, 14.0,
)  # fmt: skip


@string(
    "twist",
    "The string is stiffer in one direction.",
    amplitude("coefficient", "Nm/rad", 0.002, most=HEAVIEST),
    switches=1,
    neighbours=("string_hardening", "load_dependent_friction"),
)
def string_asymmetry(p, e, s, out):
    """-+coefficient |twist|."""
    out.string += e.q[0] * size_of(e, s, 0, s.twist)


@string(
    "twist",
    "The string creeps under load.",
    amplitude("compliance", "1", 0.03, most=0.9, signed=False),
    shape("time_constant", "s", (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0), low=0.02, high=1000.0),
    states=1,
    neighbours=("string_hysteresis",),
)
def string_creep(p, e, s, out):
    """+-compliance ktheta z, time_constant dz/dt = twist - z."""
    if s.first:
        e.z[0] = s.twist
    out.string -= e.q[0] * p.ktheta * e.z[0]
    e.rate[0] = (s.twist - e.z[0]) / e.q[1]


@string(
    "omega_u - omega_l",
    "The string has damping of its own.",
    amplitude("damping", "Nm s/rad", 0.0005, most=HEAVIEST, signed=False),
    neighbours=("encoder_delay_lower", "quadratic_drag"),
)
def string_damping(p, e, s, out):
    """-+damping (omega_u - omega_l)."""
    out.string += e.q[0] * (s.omega_u - s.omega_l)


@string(
    "twist",
    "The string stiffens with twist.",
    amplitude("coefficient", "Nm/rad^3", 0.0001, most=HEAVIEST),
    neighbours=("string_second_spring", "string_asymmetry", "string_play"),
)
def string_hardening(p, e, s, out):
    """-+coefficient twist^3."""
    out.string += e.q[0] * s.twist * s.twist * s.twist


@string(
    "twist",
    "The string's torque depends on its past (Bouc-Wen).",
    amplitude("torque", "Nm", 0.002, most=HEAVIEST, signed=False),
    shape("width", "rad", (0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.0), low=0.005, high=50.0),
    states=1,
    switches=2,
    forgets=False,
    neighbours=("string_creep", "presliding"),
    source="Wen, J. Eng. Mech. 102 (1976)",
)
def string_hysteresis(p, e, s, out):
    """-+torque z, width dz/dt = dtwist/dt - (|dtwist/dt| z + dtwist/dt |z|)/2."""
    rate, z = s.omega_u - s.omega_l, e.z[0]
    out.string += e.q[0] * z
    lost = size_of(e, s, 0, rate) * z + rate * size_of(e, s, 1, z)
    e.rate[0] = (rate - 0.5 * lost) / e.q[1]


@string(
    "omega_l",
    "The string's own inertia gives a second torsional mode.",
    shape("frequency", "Hz", _FREQUENCIES, low=0.3, high=100.0, form=0.0),
    shape("damping", "1", (0.02, 0.1), low=0.0005, high=2.0),
    formula="2 ktheta z + c dz/dt on both, -+c/2 (omega_u - omega_l), "
    "d2z/dt2 = -(domega_u/dt + domega_l/dt)/2 - w^2 z - 2 damping w dz/dt, w = 2 pi frequency, "
    "c = 4 ktheta damping/w",
    states=2,
    neighbours=("string_damping", "lower_resonator"),
)
def string_inertia(p, e, s, out):
    """A body between two halves of the string, each of stiffness 2 ktheta and damping c.

    z is its angle ahead of the mean of the discs', frequency (Hz) its own with both discs held.
    """
    middle = 0.5 * (s.omega_u + s.omega_l)
    if s.first:
        e.z[1] = middle
    # The second state is dz/dt + middle, so that no acceleration is asked for.
    wave, rate = 2.0 * pi * e.q[0], e.z[1] - middle
    e.rate[0] = rate
    e.rate[1] = -wave * wave * e.z[0] - 2.0 * e.q[1] * wave * rate
    loss = 4.0 * p.ktheta * e.q[1] / wave
    pull = 2.0 * p.ktheta * e.z[0] + loss * rate
    out.torque_u += pull
    out.torque_l += pull
    out.string += 0.5 * loss * (s.omega_u - s.omega_l)


@string(
    "twist",
    "The string's clamp has play.",
    shape("gap", "rad", _GAPS, low=0.001, form=0.05, high=20.0),
    switches=2,
    neighbours=("string_hardening", "lower_stribeck"),
)
def string_play(p, e, s, out):
    """+-ktheta clip(twist, -gap/2, gap/2)."""
    out.string -= p.ktheta * clipped(e, s, 0, s.twist, -0.5 * e.q[0], 0.5 * e.q[0])


@string(
    "twist",
    "Beyond a twist a second spring comes in, as in a coupling of two stages.",
    amplitude("stiffness", "Nm/rad", 0.005, most=HEAVIEST, signed=False),
    shape("twist", "rad", (0.4, 0.8, 1.6, 3.0, 5.0), low=0.001, high=1000.0),
    switches=2,
    neighbours=("string_hardening", "string_asymmetry"),
)
def string_second_spring(p, e, s, out):
    """-+stiffness (x - clip(x, -twist, twist)), x the string's own twist."""
    out.string += e.q[0] * (s.twist - clipped(e, s, 0, s.twist, -e.q[1], e.q[1]))
