"""The upper encoder's disc is off centre."""

from numpy import cos

from drill_env.effects._effect import Effect, amplitude, phase
from drill_env.effects.signal import response


@response
def encoder_eccentricity_upper(p, e, s, out):
    """error cos(theta_u + phase) on the reading."""
    out.angle_u += e.q[0] * cos(s.theta_u + e.q[1])


EFFECT = Effect(
    component="sensor",
    equation="upper",
    depends_on="theta_u",
    parameters=(amplitude("error", "rad", 0.003, most=0.5, signed=False), phase()),
    kernel=encoder_eccentricity_upper,
    neighbours=("gear_eccentricity",),
    senses=True,
)
