"""Errors of the encoders of both discs."""

from functools import partial

from numpy import cos

from drill_env.effects._effect import amplitude, effect, phase, shape
from drill_env.effects.signal import branch, size_of

sensor = partial(effect, "sensor")


@sensor(
    "omega_l",
    "The lower encoder reports late.",
    shape("delay", "s", (0.01, 0.02, 0.03, 0.05, 0.08, 0.12), low=0.0, high=0.5),
    delay="delay",
    neighbours=("string_damping",),
)
def encoder_delay_lower(p, e, s, out):
    """theta_l(t - delay) - theta_l(t) on the reading."""
    out.angle_l += e.theta_l_late - s.theta_l


@sensor(
    "omega_u",
    "The upper encoder reports late.",
    shape("delay", "s", (0.01, 0.02, 0.03, 0.05, 0.08, 0.12), low=0.0, high=0.5),
    delay="delay",
    neighbours=("input_delay",),
)
def encoder_delay_upper(p, e, s, out):
    """theta_u(t - delay) - theta_u(t) on the reading."""
    out.angle_u += e.theta_u_late - s.theta_u


@sensor(
    "theta_l",
    "The lower encoder's disc is off centre.",
    amplitude("error", "rad", 0.003, most=0.5, signed=False),
    phase(),
    neighbours=("unbalance",),
)
def encoder_eccentricity_lower(p, e, s, out):
    """error cos(theta_l + phase) on the reading."""
    out.angle_l += e.q[0] * cos(s.theta_l + e.q[1])


@sensor(
    "theta_u",
    "The upper encoder's disc is off centre.",
    amplitude("error", "rad", 0.003, most=0.5, signed=False),
    phase(),
    neighbours=("gear_eccentricity",),
)
def encoder_eccentricity_upper(p, e, s, out):
    """error cos(theta_u + phase) on the reading."""
    out.angle_u += e.q[0] * cos(s.theta_u + e.q[1])


@sensor(
    "theta_l",
    "The lower encoder's counts per revolution are wrong.",
    amplitude("error", "1", 0.001, most=0.5),
    neighbours=("missed_counts_lower",),
)
def encoder_gain_lower(p, e, s, out):
    """error theta_l on the reading."""
    out.angle_l += e.q[0] * s.theta_l


@sensor(
    "omega_l",
    "The lower encoder is driven with play: its reading follows a reversal late.",
    amplitude("error", "rad", 0.003, most=0.5, signed=False),
    shape("width", "rad", (0.003, 0.01, 0.03, 0.1), low=1e-4, high=10.0),
    states=1,
    switches=1,
    forgets=False,
    neighbours=("missed_counts_lower", "encoder_delay_lower"),
    source="Dahl, Aerospace Corp. TOR-0158 (1968)",
)
def encoder_play_lower(p, e, s, out):
    """-error z on the reading, width dz/dt = omega_l - |omega_l| z."""
    out.angle_l -= e.q[0] * e.z[0]
    e.rate[0] = (s.omega_l - size_of(e, s, 0, s.omega_l) * e.z[0]) / e.q[1]


@sensor(
    "omega_u",
    "The upper encoder is driven with play: its reading follows a reversal late.",
    amplitude("error", "rad", 0.003, most=0.5, signed=False),
    shape("width", "rad", (0.003, 0.01, 0.03, 0.1), low=1e-4, high=10.0),
    states=1,
    switches=1,
    forgets=False,
    neighbours=("missed_counts_upper", "encoder_delay_upper"),
    source="Dahl, Aerospace Corp. TOR-0158 (1968)",
)
def encoder_play_upper(p, e, s, out):
    """-error z on the reading, width dz/dt = omega_u - |omega_u| z."""
    out.angle_u -= e.q[0] * e.z[0]
    e.rate[0] = (s.omega_u - size_of(e, s, 0, s.omega_u) * e.z[0]) / e.q[1]


@sensor(
    "omega_l",
    "The lower encoder loses counts when it turns fast.",
    amplitude("share", "1", 0.001, most=0.5, signed=False),
    shape("speed", "rad/s", (2.0, 4.0, 6.0, 8.0, 10.0), low=0.0, high=10000.0),
    states=1,
    switches=2,
    neighbours=("encoder_gain_lower",),
)
def missed_counts_lower(p, e, s, out):
    """-share of the way turned while |omega_l| > speed, on the reading."""
    forward, backward = branch(e, s, 0, s.omega_l - e.q[1]), branch(e, s, 1, -s.omega_l - e.q[1])
    e.rate[0] = s.omega_l if forward > 0 or backward > 0 else 0.0
    out.angle_l -= e.q[0] * e.z[0]


@sensor(
    "omega_u",
    "The upper encoder loses counts when it turns fast.",
    amplitude("share", "1", 0.001, most=0.5, signed=False),
    shape("speed", "rad/s", (2.0, 4.0, 6.0, 8.0, 10.0), low=0.0, high=10000.0),
    states=1,
    switches=2,
)
def missed_counts_upper(p, e, s, out):
    """-share of the way turned while |omega_u| > speed, on the reading."""
    forward, backward = branch(e, s, 0, s.omega_u - e.q[1]), branch(e, s, 1, -s.omega_u - e.q[1])
    e.rate[0] = s.omega_u if forward > 0 or backward > 0 else 0.0
    out.angle_u -= e.q[0] * e.z[0]
