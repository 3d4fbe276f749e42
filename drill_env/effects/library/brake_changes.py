"""Friction of the lower disc that changes as the run goes on."""

from functools import partial

from numpy import exp

from drill_env.effects._effect import EffectParameter, amplitude, effect, shape
from drill_env.effects.signal import branch

lower = partial(effect, "lower")


@lower(
    "time",
    "The brake's friction drifts (it dries).",
    amplitude("drift", "1/min", 0.05, most=3.0),
    neighbours=("wear", "friction_heating", "friction_settling"),
)
def friction_drift(p, e, s, out):
    """-drift t/(60 s) T_fl."""
    out.scale_l += e.q[0] * s.t / 60.0


@lower(
    "time",
    "The brake's friction falls as it warms.",
    amplitude("loss", "1", 0.05, most=0.95, signed=False),
    shape("time_constant", "s", (3.0, 6.0, 12.0, 25.0, 50.0, 120.0), low=2.0, high=10000.0),
    states=1,
    neighbours=("friction_drift", "wear", "friction_settling"),
)
def friction_heating(p, e, s, out):
    """loss h T_fl, time_constant dh/dt = T_l |omega_l|/(0.5 W) - h."""
    out.scale_l -= e.q[0] * e.z[0]
    e.rate[0] = (s.friction_l * s.speed_l / 0.5 - e.z[0]) / e.q[1]


@lower(
    "time",
    "The brake's friction falls, or grows, after the start and settles.",
    # Friction may grow to several times its size, but not fall below nothing.
    EffectParameter("change", "1", "amplitude", (0.05,), -3.0, 0.95),
    shape("time_constant", "s", (3.0, 6.0, 12.0, 25.0, 50.0, 100.0), low=0.5, high=1000.0),
    neighbours=("friction_drift", "friction_heating", "wear"),
    rigs_own_if_early=True,
)
def friction_settling(p, e, s, out):
    """change (1 - e^(-t/time_constant)) T_fl."""
    out.scale_l -= e.q[0] * (1.0 - exp(-s.t / e.q[1]))


@lower(
    "time",
    "The brake's friction changes at one moment.",
    amplitude("step", "1", 0.05, most=3.0),
    shape("time", "s", tuple(3.0 * k for k in range(1, 20)), low=0.0, high=100000.0, form=0.0),
    switches=1,
    neighbours=("friction_drift", "torque_pulse"),
    rigs_own_if_early=True,
)
def friction_step(p, e, s, out):
    """-step T_fl after time."""
    if branch(e, s, 0, s.t - e.q[1]) > 0:
        out.scale_l += e.q[0]


@lower(
    "distance",
    "The brake wears with the way it has gone.",
    amplitude("loss", "1", 0.05, most=0.95),
    shape("distance", "rad", (25.0, 80.0, 250.0, 800.0), low=1.0, high=100000.0),
    states=1,
    forgets=False,
    neighbours=("friction_drift", "friction_heating"),
)
def wear(p, e, s, out):
    """-loss (1 - e^(-s/distance)) T_fl, ds/dt = |omega_l|."""
    out.scale_l -= e.q[0] * (1.0 - exp(-e.z[0] / e.q[1]))
    e.rate[0] = s.speed_l
