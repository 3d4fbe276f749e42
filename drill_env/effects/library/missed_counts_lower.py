"""The lower encoder loses counts when it turns fast."""

from drill_env.effects._effect import Effect, amplitude, shape
from drill_env.effects.signal import branch, response


@response
def missed_counts_lower(p, e, s, out):
    """-share of the way above the speed on the reading."""
    if s.first:
        e.z[0] = 0.0
    forward, backward = branch(e, s, 0, s.omega_l - e.q[1]), branch(e, s, 1, -s.omega_l - e.q[1])
    e.rate[0] = s.omega_l if forward > 0 or backward > 0 else 0.0
    out.angle_l -= e.q[0] * e.z[0]


EFFECT = Effect(
    component="sensor",
    equation="lower",
    depends_on="omega_l",
    parameters=(
        amplitude("share", "1", 0.001, most=0.5, signed=False),
        shape("speed", "rad/s", (2.0, 4.0, 6.0, 8.0, 10.0), low=0.0, high=100.0),
    ),
    kernel=missed_counts_lower,
    states=1,
    switches=2,
    neighbours=("encoder_gain_lower",),
    senses=True,
)
