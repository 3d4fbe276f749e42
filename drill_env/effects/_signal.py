"""What an effect reads and writes at one instant, and the helpers its kernel shares with others."""

from math import exp

import numpy as np
from numba import float64, from_dtype, types
from numba.core.typing.templates import signature

from drill_env._jit import caller, inlined, unit
from drill_env.parameters._record import PARAMETERS

SIGNAL = np.dtype(
    [
        ("first", "i8"),  # 1 at the first row of a recording or run
        ("t", "f8"),  # since the start, s
        ("dt", "f8"),  # for which the torques will be held, s
        ("u", "f8"),  # held voltage, V
        ("theta_u", "f8"),
        ("theta_l", "f8"),
        ("omega_u", "f8"),
        ("omega_l", "f8"),
        ("alpha_u", "f8"),  # accelerations, rad/s^2
        ("alpha_l", "f8"),
        ("twist", "f8"),
        ("friction_u", "f8"),  # sizes of the sliding torques at these speeds, Nm
        ("friction_l", "f8"),
        ("net_u", "f8"),  # torques on the discs without their friction, Nm
        ("net_l", "f8"),
    ],
    align=True,
)
"""State of the rig at the middle of a held interval, or at a sample for sensors' effects."""

RESPONSE = np.dtype([(n, "f8") for n in ("torque_u", "torque_l", "angle_u", "angle_l")], align=True)
"""Torques (Nm) on the discs and errors (rad) of the encoders, added to what is already there."""

_RESPOND = signature(
    types.none, from_dtype(PARAMETERS), float64[::1], float64[::1], from_dtype(SIGNAL),
    from_dtype(RESPONSE),
)  # fmt: skip

response = unit(_RESPOND)
"""Decorator of an effect's function of (p, q, m, s, out), see `Effect`."""

respond = caller(_RESPOND)
"""For kernels: `respond(code, p, q, m, s, out)`, with the code of an effect."""

MEMORY = 640
"""Numbers an effect may remember, all 0 at the start."""

RESTING = 0.15
"""Speed (rad/s) of the upper disc, in the middle of the first interval, that counts as rest."""


@inlined
def sign(value):
    """-1, 0 or 1."""
    return 1.0 if value > 0.0 else (-1.0 if value < 0.0 else 0.0)


@inlined
def left_over(shares):
    """Mean of e^-x from 0 to `shares`: what is left, on average, of something that decays."""
    return (1.0 - exp(-shares)) / shares if shares > 1e-6 else 1.0 - 0.5 * shares


@inlined
def against(omega, net, torque):
    """The torque (Nm) with which additional friction of size `torque` acts on a disc.

    A resting disc is held by no more than what pulls on it; less friction pushes it on.
    """
    if omega != 0.0:
        return -sign(omega) * torque
    if torque >= 0.0:
        return -min(max(net, -torque), torque)
    return -sign(net) * torque


@inlined
def at_start(s):
    """Voltage (V) before a recording: none if the rig rested, else what it begins with."""
    return 0.0 if abs(s.omega_u) < RESTING else s.u
