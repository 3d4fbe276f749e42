"""The brake wears with the way it has gone."""

from numpy import exp

from drill_env.effects._effect import Effect, amplitude, shape
from drill_env.effects.signal import response


@response
def wear(p, e, s, out):
    """-loss (1 - e^(-s/distance)) T_fl, ds/dt = |omega_l|."""
    if s.first:
        e.z[0] = 0.0
    out.scale_l -= e.q[0] * (1.0 - exp(-e.z[0] / e.q[1]))
    e.rate[0] = s.speed_l


EFFECT = Effect(
    component="lower",
    equation="lower",
    depends_on="distance",
    parameters=(
        amplitude("loss", "1", 0.05, most=0.95),
        shape("distance", "rad", (25.0, 80.0, 250.0, 800.0), low=1.0, high=100000.0),
    ),
    kernel=wear,
    autonomous=False,
    states=1,
    neighbours=("friction_drift", "friction_heating"),
)
