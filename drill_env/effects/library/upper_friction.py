"""Friction of the upper disc's bearing."""

from functools import partial

from numpy import exp

from drill_env._jit import kernel
from drill_env.effects._effect import HEAVIEST, amplitude, effect, shape
from drill_env.effects.library.brake import give_way
from drill_env.effects.signal import RESTING, clipped, size_of

upper = partial(effect, "upper")

_DISTANCES = (4e-6, 1e-5, 2e-5, 5e-5, 1e-4, 3e-4, 1e-3, 5e-3, 0.02, 0.1)


@upper(
    "time",
    "The upper bearing's friction falls as it warms.",
    amplitude("excess", "1", 0.05, most=3.0, signed=False),
    shape("time_constant", "s", (3.0, 6.0, 12.0, 25.0, 50.0, 100.0), low=2.0, high=1000.0),
    neighbours=("motor_heating",),
    rigs_own_if_slow=True,
)
def friction_warmup(p, e, s, out):
    """-excess e^(-t/time_constant) T_fu."""
    out.scale_u += e.q[0] * exp(-s.t / e.q[1])


@upper(
    "twist",
    "The upper bearing rubs harder under the string's torque.",
    amplitude("coefficient", "1", 0.05, most=5.0, signed=False, form=0.04),
    switches=1,
    neighbours=("string_asymmetry",),
)
def load_dependent_friction(p, e, s, out):
    """-sign(omega_u) coefficient |ktheta twist|."""
    out.size_u += e.q[0] * size_of(e, s, 0, s.pull)


@upper(
    "omega_u",
    "The upper disc is damped more in one direction than in the other.",
    amplitude("damping", "Nm s/rad", 0.02, most=HEAVIEST),
    neighbours=("upper_offset", "gain_asymmetry"),
    stands_for="dbu",
)
def upper_asymmetry(p, e, s, out):
    """-damping |omega_u|."""
    out.torque_u -= e.q[0] * s.side_u * s.omega_u


@upper(
    "omega_u",
    "The upper disc rubs at every speed alike (Coulomb).",
    amplitude("torque", "Nm", 0.1, most=HEAVIEST, signed=False),
    neighbours=("upper_stribeck", "upper_viscous"),
    stands_for="Tsu",
    at_rest=True,
    common=True,
)
def upper_coulomb(p, e, s, out):
    """-sign(omega_u) torque."""
    out.size_u += e.q[0]


# Share of the lagging torque that holds a disc at rest where all else holds it by less: how much of
# the lag is taken up is a ratio to what is left, and undetermined where nothing is.
_LEAST = 0.01


@kernel
def held_share(p, e, s, out, torque):
    """What stands for the sign at rest: the share that is taken of all friction but the late one.

    It is 1 where the disc leaves: as the pull rises slowly the disc creeps and does not chatter.
    """
    motor = out.drive * p.km * (s.u + out.volts) + out.torque_u + s.other_u
    pull = motor - s.pull - out.string - p.dTsu * (1.0 + out.scale_u) - torque * e.z[0]
    level = p.Tsu * (1.0 + out.scale_u) + out.size_u - torque
    if level.real < _LEAST * torque.real:
        out.size_u += _LEAST * torque - level
        level = _LEAST * torque
    held = clipped(e, s, 0, pull, -level, level)
    return held / level if level.real > 0.0 else 0.0 * held


@upper(
    "omega_u",
    "The upper disc's Coulomb friction follows a reversal late.",
    amplitude("torque", "Nm", 0.1, most=HEAVIEST, signed=False),
    shape("time_constant", "s", (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1), low=1e-4, high=5.0),
    states=1,
    switches=2,
    neighbours=("upper_presliding", "gear_compliance", "actuator_lag"),
    source="Hess and Soom, J. Tribology 112 (1990)",
    last=True,
    axis_only=True,
    at_rest=True,
)
def upper_friction_lag(p, e, s, out):
    """(sign(omega_u) - z) torque, time_constant dz/dt = sign(omega_u) - z."""
    torque = e.q[0]
    side = held_share(p, e, s, out, torque) if s.rest_u else 1.0 * s.side_u
    if s.first:
        # At rest nothing has built up.
        e.z[0] = 0.0 if abs(s.omega_u) < RESTING else s.side_u
    out.size_u -= torque
    out.torque_u -= torque * e.z[0]
    e.rate[0] = (side - e.z[0]) / e.q[1]


@upper(
    "omega_u",
    "The upper disc's friction is higher at low speed, and falls with the square of it.",
    amplitude("torque", "Nm", 0.02, most=HEAVIEST, signed=False),
    shape("velocity", "rad/s", (0.05, 0.15, 0.4, 1.0, 2.5), low=0.001, high=1000.0),
    neighbours=("upper_stribeck", "amplifier_deadzone"),
    source="Armstrong-Helouvry, Control of Machines with Friction (1991)",
    at_rest=True,
)
def upper_gaussian_stribeck(p, e, s, out):
    """-sign(omega_u) torque exp(-(omega_u/velocity)^2)."""
    share = s.speed_u / e.q[1]
    out.size_u += e.q[0] * exp(-share * share)


@upper(
    "voltage",
    "The axis rubs harder under the torque of its drive.",
    # At 1 the drive moves nothing.
    amplitude("coefficient", "1", 0.05, most=1.0, signed=False),
    switches=1,
    # With another motor constant it is a motor that gives more torque where it brakes.
    aliases=("drive_braking_loss",),
    axis_only=True,
)
def upper_load_friction(p, e, s, out):
    """-sign(omega_u) coefficient |km u|."""
    out.size_u += e.q[0] * p.km * size_of(e, s, 0, s.u)


@upper(
    "theta_u",
    "The upper disc yields elastically before it slides (Dahl).",
    amplitude("torque", "Nm", 0.1, most=HEAVIEST, signed=False),
    shape("distance", "rad", _DISTANCES, low=1e-7, high=3.0),
    states=1,
    switches=1,
    neighbours=("upper_friction_lag",),
    source="Dahl, Aerospace Corp. TOR-0158 (1968)",
    axis_only=True,
    at_rest=True,
)
def upper_presliding(p, e, s, out):
    """(sign(omega_u) - z) torque, distance dz/dt = omega_u (1 - sign(omega_u) z)."""
    if s.first:
        # At rest nothing has built up.
        e.z[0] = 0.0 if abs(s.omega_u) < RESTING else s.side_u
    out.size_u -= e.q[0]
    out.torque_u -= e.q[0] * e.z[0]
    give_way(e, s, s.rest_u, s.omega_u, s.side_u, e.q[1])


@upper(
    "omega_u",
    "The upper disc meets a drag that grows with the square of its speed.",
    amplitude("coefficient", "Nm s^2/rad^2", 0.005, most=HEAVIEST, signed=False),
    neighbours=("supply_sag",),
)
def upper_quadratic_drag(p, e, s, out):
    """-coefficient |omega_u| omega_u."""
    out.torque_u -= e.q[0] * s.side_u * s.omega_u * s.omega_u


@upper(
    "omega_u",
    "The upper disc's friction is higher at low speed.",
    amplitude("torque", "Nm", 0.02, most=HEAVIEST, signed=False),
    shape("velocity", "rad/s", (0.03, 0.07, 0.15, 0.3, 0.6, 1.0, 1.6), low=0.001, high=1000.0),
    neighbours=("upper_gaussian_stribeck", "amplifier_deadzone"),
    source="Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994)",
    at_rest=True,
)
def upper_stribeck(p, e, s, out):
    """-sign(omega_u) torque exp(-|omega_u|/velocity)."""
    out.size_u += e.q[0] * exp(-s.speed_u / e.q[1])


@upper(
    "omega_u",
    "The upper disc is damped in proportion to its speed (viscous).",
    amplitude("damping", "Nm s/rad", 0.1, most=HEAVIEST, signed=False),
    neighbours=("upper_quadratic_drag", "upper_coulomb"),
    stands_for="bu",
    common=True,
)
def upper_viscous(p, e, s, out):
    """-damping omega_u."""
    out.torque_u -= e.q[0] * s.omega_u
