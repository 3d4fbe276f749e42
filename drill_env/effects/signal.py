"""What an effect reads and writes at one instant, and the helpers that kernels share."""

import numpy as np
from numba import from_dtype, types
from numba.core.typing.templates import signature

from drill_env._intrinsics import placed
from drill_env._jit import caller, inlined, unit
from drill_env.parameters.record import PARAMETERS

SIGNAL = np.dtype(
    [
        ("first", "i8"),  # 1 where the inner states take their first values
        # 1 where branches follow their functions at once, 2 where the state comes without any
        ("choose", "i8"),
        ("settle", "i8"),  # 1 where a switch has just closed: it may put to rest what it ends
        ("rest_u", "i8"), ("rest_l", "i8"),  # whether the disc sticks
        ("t", "f8"),  # since the start, s
        ("u", "f8"), ("u_rate", "f8"),  # voltage asked for, V, and its rate, V/s
        ("theta_u", "f8"), ("theta_l", "f8"), ("twist", "f8"), ("omega_u", "f8"), ("omega_l", "f8"),
        # Slip direction, -1 or 1; of a disc at rest, where it would leave to.
        ("side_u", "f8"), ("side_l", "f8"),
        ("speed_u", "f8"), ("speed_l", "f8"),  # along that direction, 0 at rest
        ("pull", "f8"),  # torque of the string by the rig's own stiffness, Nm
        # Sizes of the rig's own friction torques at these speeds, Nm.
        ("friction_u", "f8"), ("friction_l", "f8"),
        # Torques of other effects, where these are asked one by one, Nm.
        ("other_u", "f8"), ("other_l", "f8"),
        ("dwell_l", "f8"),  # time for which the lower disc has been at rest, s
    ],
    align=True,
)  # fmt: skip
"""State of the rig at one instant."""

PORTS = np.dtype(
    [
        ("volts", "f8"),  # added to the voltage, V
        ("drive", "f8"),  # share of the motor's torque that reaches the disc itself
        ("torque_u", "f8"), ("torque_l", "f8"),  # on the discs, Nm
        ("string", "f8"),  # added to the torque of the string, Nm
        ("size_u", "f8"), ("size_l", "f8"),  # added to the size of the friction, Nm
        ("scale_u", "f8"), ("scale_l", "f8"),  # the same as a share of the rig's own law
        ("read_l", "f8"),  # speed at which the lower law is read, rad/s
        ("inertia_u", "f8"),  # added to the upper disc, kg m^2
        ("angle_u", "f8"), ("angle_l", "f8"),  # errors of the encoders, rad
    ],
    align=True,
)  # fmt: skip
"""Where an effect enters the equations of motion; each adds to what is already there."""

MOST_NUMBERS, MOST_STATES, MOST_SWITCHES = 8, 4, 5
# Of all effects of a rig together.
MOST_INNER, MOST_BRANCHES = 24, 32

ENTRY = np.dtype(
    [
        ("code", "i8"),  # address for `respond`, of this process alone
        ("senses", "i8"),  # whether the encoders are wrong and not the rig
        ("idle", "i8"),  # whether the motion is the same without it
        ("delayed", "i8"),  # whether it reads the past
        ("timed", "i8"),  # whether it may change while nothing moves
        ("sided", "i8"),  # whether it may differ between the two sides of a disc at rest
        ("reads_law", "i8"),  # whether it reads the lower disc's own friction
        ("moves_law", "i8"),  # whether it has the lower law read at another speed
        ("drives", "i8"),  # whether it puts a motor of its own between voltage and disc
        ("paced", "i8"),  # whether the motion sets how fast its inner states relax
        ("upper", "i8"), ("only_at_rest", "i8"),  # whether on the upper disc, on one at rest alone
        ("states", "i8"), ("switches", "i8"),  # how many, and the first ones' places among those
        ("first_state", "i8"), ("first_switch", "i8"),  # of all effects
        ("delay", "f8"),  # by which it reads the past, s
        ("hertz", "f8"),  # at which it swings with time alone, 0 if it does not
        ("table", "i8"),  # address of knots and values of a measured curve
        ("q", "f8", (MOST_NUMBERS,)),  # its numbers
        ("z", "f8", (MOST_STATES,)), ("rate", "f8", (MOST_STATES,)),  # inner states and their rates
        ("side", "i8", (MOST_SWITCHES,)),  # branch that each switch is on
        ("gap", "f8", (MOST_SWITCHES,)),  # the branch ends where this turns negative
        ("next", "i8", (MOST_SWITCHES,)),  # and this one follows
        ("u_late", "f8"), ("theta_u_late", "f8"), ("theta_l_late", "f8"),  # its delay ago
    ],
    align=True,
)  # fmt: skip
"""One declared effect with its working place."""


def number_places(entries: np.ndarray) -> None:
    """Fill in the first inner state and the first switch of each entry, records of `ENTRY`."""
    for first, count in (("first_state", "states"), ("first_switch", "switches")):
        entries[first] = np.cumsum(entries[count]) - entries[count]


entry_at = placed(ENTRY)
"""For kernels: `entry_at(address, i)`."""

_RESPOND = signature(
    types.none, from_dtype(PARAMETERS), from_dtype(ENTRY), from_dtype(SIGNAL), from_dtype(PORTS)
)

response = unit(_RESPOND)
"""Decorator of an effect's function of (p, e, s, out), see `Effect`."""


def _with_slopes(kind: np.dtype, plain: tuple[str, ...]) -> np.dtype:
    """A record whose numbers carry a derivative in their imaginary part, but for some."""
    fields = []
    for name in kind.names or ():
        field = kind[name]
        base = "c16" if field.base == np.float64 and name not in plain else field.base
        fields.append((name, base, field.shape))
    return np.dtype(fields, align=True)


PARAMETERS_SLOPES = _with_slopes(PARAMETERS, ("clamp_low", "clamp_high"))
ENTRY_SLOPES = _with_slopes(ENTRY, ("delay", "hertz"))
SIGNAL_SLOPES = _with_slopes(SIGNAL, ("side_u", "side_l"))
PORTS_SLOPES = _with_slopes(PORTS, ())

RESPOND_SLOPES = signature(
    types.none, from_dtype(PARAMETERS_SLOPES), from_dtype(ENTRY_SLOPES), from_dtype(SIGNAL_SLOPES),
    from_dtype(PORTS_SLOPES),
)  # fmt: skip
"""An effect's function in complex arithmetic, for its exact derivatives by complex steps."""

respond = caller(_RESPOND, RESPOND_SLOPES)
"""For kernels: `respond(code, p, e, s, out)`."""


@inlined
def clear_ports(out, s):
    """Nothing added, the lower law read at the disc's own speed."""
    out.volts = out.torque_u = out.torque_l = out.string = 0.0
    out.size_u = out.size_l = out.scale_u = out.scale_l = out.inertia_u = 0.0
    out.angle_u = out.angle_l = 0.0
    out.drive = 1.0
    out.read_l = s.speed_l


RESTING = 0.15
"""Speed (rad/s) of the upper disc that counts as rest at the start."""


@inlined
def branch(e, s, j, x):
    """Side of zero, -1 or 1, that `x` is on.

    Within a step the integrator holds it: it ends the step where `x` changes its sign, so that
    no step ever meets a corner.
    """
    if s.choose or e.side[j] == 0:
        e.side[j] = 1 if x.real >= 0.0 else -1
    e.gap[j] = e.side[j] * x
    e.next[j] = -e.side[j]
    return e.side[j]


@inlined
def size_of(e, s, j, x):
    """abs(x), by switch `j`."""
    return branch(e, s, j, x) * x


@inlined
def clipped(e, s, j, x, low, high):
    """`x` within limits, by switches `j` and `j` + 1."""
    above, below = branch(e, s, j, x - high), branch(e, s, j + 1, low - x)
    return high if above > 0 else (low if below > 0 else x)


@inlined
def at_start(s):
    """Voltage (V) before the start: none if the rig rested, else what it begins with."""
    return 0.0 if abs(s.omega_u) < RESTING else s.u
