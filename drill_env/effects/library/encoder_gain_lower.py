"""The lower encoder's counts per revolution are wrong."""

from drill_env.effects._effect import Effect, amplitude
from drill_env.effects.signal import response


@response
def encoder_gain_lower(p, e, s, out):
    """error theta_l on the reading."""
    out.angle_l += e.q[0] * s.theta_l


EFFECT = Effect(
    component="sensor",
    equation="lower",
    depends_on="theta_l",
    parameters=(amplitude("error", "1", 0.001, most=0.5),),
    kernel=encoder_gain_lower,
    neighbours=("missed_counts_lower",),
    senses=True,
)
