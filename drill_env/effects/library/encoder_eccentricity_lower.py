"""The lower encoder's disc is off centre."""

from numpy import cos

from drill_env.effects._effect import Effect, amplitude, phase
from drill_env.effects.signal import response


@response
def encoder_eccentricity_lower(p, e, s, out):
    """error cos(theta_l + phase) on the reading."""
    out.angle_l += e.q[0] * cos(s.theta_l + e.q[1])


EFFECT = Effect(
    component="sensor",
    equation="lower",
    depends_on="theta_l",
    parameters=(amplitude("error", "rad", 0.003, most=0.5, signed=False), phase()),
    kernel=encoder_eccentricity_lower,
    neighbours=("unbalance",),
    senses=True,
)
