"""Friction of the lower disc by its speed and its past."""

from functools import partial

from numpy import cos, exp, log

from drill_env._jit import kernel
from drill_env.effects._effect import HEAVIEST, amplitude, effect, phase, shape
from drill_env.effects.signal import branch

lower = partial(effect, "lower")

_LAGS = (0.005, 0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.6)

# What is left of yielding below this is none: under the tolerance of any step that a rig's motion
# needs, while steps that followed it on would stay as short as the yielding once was.
_NONE_LEFT = 1e-10


@kernel
def give_way(e, s, rest, omega, side, distance):
    """Rate of what has yielded, `e.z[0]`, a share from -1 to 1: omega (1 - side z)/distance."""
    if rest:
        e.rate[0] = 0.0 * omega
        return
    left = 1.0 - side * e.z[0]
    if branch(e, s, 0, _NONE_LEFT - left) > 0:
        e.rate[0] = 0.0 * omega
        # The switch that closes may be another effect's, where the disc has just turned back.
        if s.settle and left.real < 10.0 * _NONE_LEFT:
            e.z[0] = side
    else:
        e.rate[0] = omega * left / distance


@lower(
    "theta_l",
    "The brake disc is not flat: friction changes with its angle.",
    amplitude("runout", "1", 0.05, most=0.99, signed=False),
    phase(),
    shape("order", "1", (1.0, 2.0, 3.0, 4.0), low=0.2, high=100.0, form=0.0),
    neighbours=("unbalance",),
)
def brake_runout(p, e, s, out):
    """-runout cos(order theta_l + phase) T_fl."""
    out.scale_l += e.q[0] * cos(e.q[2] * s.theta_l + e.q[1])


@lower(
    "dwell time",
    "The brake sticks harder the longer it rests.",
    amplitude("torque", "Nm", 0.003, most=HEAVIEST, signed=False),
    shape("time_constant", "s", (0.2, 0.7, 2.5, 9.0), low=0.005, high=1000.0),
    neighbours=("lower_stribeck", "rate_state"),
    source="Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994)",
    at_rest=True,
    only_at_rest=True,
)
def dwell_stiction(p, e, s, out):
    """holds torque (1 - e^(-dwell/time_constant)) more, until it slips."""
    if s.rest_l:
        out.size_l += e.q[0] * (1.0 - exp(-s.dwell_l / e.q[1]))


@lower(
    "omega_l",
    "The brake's torque follows the speed late.",
    shape("time_constant", "s", _LAGS, low=0.0005, high=20.0),
    states=1,
    neighbours=("rate_state", "presliding", "string_damping"),
    source="Hess and Soom, J. Tribology 112 (1990)",
    at_rest=True,
)
def friction_lag(p, e, s, out):
    """-sign(omega_l) (T_l(w) - T_l(|omega_l|)), time_constant dw/dt = |omega_l| - w."""
    if s.first:
        e.z[0] = s.speed_l
    out.read_l += e.z[0] - s.speed_l
    e.rate[0] = (s.speed_l - e.z[0]) / e.q[0]


@lower(
    "omega_l",
    "The brake rubs harder in one direction.",
    amplitude("asymmetry", "1", 0.02, most=0.95),
    neighbours=("lower_disturbance",),
)
def lower_asymmetry(p, e, s, out):
    """-asymmetry T_l(|omega_l|)."""
    out.scale_l += e.q[0] * s.side_l


@lower(
    "omega_l",
    "The brake grips harder near rest, and gives way with the square of speed.",
    amplitude("torque", "Nm", 0.001, most=HEAVIEST, signed=False),
    shape("velocity", "rad/s", (0.03, 0.1, 0.3, 0.6, 1.2, 2.5), low=0.001, form=0.02, high=1000.0),
    neighbours=("lower_stribeck", "dwell_stiction", "friction_lag"),
    source="Armstrong-Helouvry, Control of Machines with Friction (1991)",
    at_rest=True,
)
def lower_gaussian_stribeck(p, e, s, out):
    """-sign(omega_l) torque exp(-(omega_l/velocity)^2)."""
    share = s.speed_l / e.q[1]
    out.size_l += e.q[0] * exp(-share * share)


@lower(
    "omega_l",
    "The brake grips harder near rest than the law says.",
    amplitude("torque", "Nm", 0.001, most=HEAVIEST, signed=False),
    shape("velocity", "rad/s", (0.02, 0.05, 0.1, 0.2, 0.4, 0.8), low=0.001, form=0.02, high=1000.0),
    neighbours=("lower_gaussian_stribeck", "dwell_stiction", "friction_lag"),
    source="Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994)",
    at_rest=True,
)
def lower_stribeck(p, e, s, out):
    """-sign(omega_l) torque exp(-|omega_l|/velocity)."""
    out.size_l += e.q[0] * exp(-s.speed_l / e.q[1])


@lower(
    "theta_l",
    "The brake yields elastically before it slides (Dahl).",
    shape("distance", "rad", (0.005, 0.01, 0.02, 0.04, 0.08, 0.15, 0.3), low=0.0002, high=3.0),
    states=1,
    switches=1,
    neighbours=("lower_lugre", "friction_lag", "string_hysteresis"),
    source="Dahl, Aerospace Corp. TOR-0158 (1968)",
    at_rest=True,
)
def presliding(p, e, s, out):
    """(sign(omega_l) - z) T_l, distance dz/dt = omega_l (1 - sign(omega_l) z)."""
    # What it has yielded takes the place of the direction, and nothing sticks.
    out.scale_l -= 1.0
    out.torque_l -= e.z[0] * s.friction_l
    give_way(e, s, s.rest_l, s.omega_l, s.side_l, e.q[0])


@lower(
    "theta_l",
    "The brake's contact is a spring that yields, as stiff at every speed (LuGre).",
    shape("stiffness", "Nm/rad", (0.5, 1.0, 2.0, 4.0, 8.0, 16.0), low=1e-6, high=1e7),
    formula="sign(omega_l) T_l - F, dF/dt = stiffness (omega_l - |omega_l| F/g), "
    "g = T_l, at least Tsl/10",
    states=1,
    switches=1,
    neighbours=("presliding", "friction_lag"),
    source="Canudas de Wit, Olsson, Astrom and Lischinsky, IEEE Trans. Autom. Control 40 (1995)",
    at_rest=True,
)
def lower_lugre(p, e, s, out):
    """F in place of sign(omega_l) T_l, see `formula`; `presliding` yields over a constant way."""
    out.scale_l -= 1.0
    out.torque_l -= e.z[0]
    # A law that falls below 0 at high speed is none that a spring yields at.
    least = 0.1 * p.Tsl
    level = (
        s.friction_l if branch(e, s, 0, s.friction_l - least) > 0 else least + 0.0 * s.friction_l
    )
    e.rate[0] = e.q[0] * (s.omega_l - s.speed_l * e.z[0] / level)


# Share of `speed` at which steady contact stops growing older.
_AT_REST = 0.05


@lower(
    "omega_l",
    "The brake remembers how long it has been in contact (rate and state).",
    amplitude("torque", "Nm", 0.001, most=HEAVIEST, signed=False),
    shape("distance", "rad", (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0), low=0.001, high=50.0),
    shape("speed", "rad/s", (0.1, 0.7), low=0.001, high=50.0),
    formula="-sign(omega_l) torque ln((1 + sharp psi)/(1 + sharp psi_s)), dpsi/dt = 1 - psi/psi_s, "
    "sharp = speed/distance, psi_s = distance/(|omega_l| + speed/20)",
    states=1,
    neighbours=("friction_lag", "dwell_stiction"),
    source="Dieterich, J. Geophys. Res. 84 (1979); Ruina (1983)",
    at_rest=True,
)
def rate_state(p, e, s, out):
    """-sign(omega_l) torque ln((1 + sharp psi)/(1 + sharp psi_s)), dpsi/dt = 1 - psi/psi_s."""
    # The steady part is a function of speed alone, which the brake's law has already.
    # A step that passes rest looks beyond it, where the speed along the contact is negative.
    speed = s.speed_l if s.speed_l.real >= 0.0 else -s.speed_l
    rest = e.q[1] / (speed + _AT_REST * e.q[2])
    if s.first:
        e.z[0] = rest
    sharp = e.q[2] / e.q[1]
    out.size_l += e.q[0] * log((1.0 + sharp * e.z[0]) / (1.0 + sharp * rest))
    e.rate[0] = 1.0 - e.z[0] / rest
