"""A gear runs out of true: the drive's torque varies once a turn."""

from numpy import cos

from drill_env.effects._effect import Effect, amplitude, phase
from drill_env.effects.signal import response


@response
def gear_eccentricity(p, e, s, out):
    """km u eccentricity cos(theta_u + phase)."""
    out.volts += s.u * e.q[0] * cos(s.theta_u + e.q[1])


EFFECT = Effect(
    component="upper",
    equation="upper",
    depends_on="theta_u",
    parameters=(amplitude("eccentricity", "1", 0.02, most=1.0, signed=False), phase()),
    kernel=gear_eccentricity,
    autonomous=False,
    neighbours=("torque_ripple", "encoder_eccentricity_upper"),
)
