"""The brake wears with the way it has gone."""

from math import exp

from drill_env.effects._effect import Effect, amplitude, shape
from drill_env.effects._signal import against, response


@response
def wear(p, q, m, s, out):
    """-loss (1 - e^(-s/distance)) T_fl, ds/dt = |omega_l|."""
    m[0] += abs(s.omega_l) * s.dt
    share = q[0] * (1.0 - exp(-m[0] / q[1]))
    out.torque_l += against(s.omega_l, s.net_l, -share * s.friction_l)


EFFECT = Effect(
    id="wear",
    component="lower",
    equation="lower",
    depends_on="distance",
    parameters=(
        amplitude("loss", "1", 0.05, most=0.95),
        shape(
            "distance",
            "rad",
            (
                25.0,
                80.0,
                250.0,
                800.0,
            ),
            low=1.0,
            high=100000.0,
        ),
    ),
    formula="-loss (1 - e^(-s/distance)) T_fl, ds/dt = |omega_l|",
    meaning="The brake wears with the way it has gone.",
    kernel=wear,
    friction=True,
    neighbours=(
        "friction_drift",
        "friction_heating",
    ),
)
