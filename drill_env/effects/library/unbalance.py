"""The lower disc is out of balance."""

from numpy import cos

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, phase
from drill_env.effects.signal import response


@response
def unbalance(p, e, s, out):
    """torque cos(theta_l + phase)."""
    out.torque_l += e.q[0] * cos(s.theta_l + e.q[1])


EFFECT = Effect(
    component="lower",
    equation="lower",
    depends_on="theta_l",
    parameters=(amplitude("torque", "Nm", 0.002, most=HEAVIEST, signed=False), phase()),
    kernel=unbalance,
    autonomous=False,
    neighbours=("encoder_eccentricity_lower", "brake_runout"),
)
