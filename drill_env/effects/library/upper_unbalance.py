"""The upper disc, or what the axis carries, is out of balance (a pendulum)."""

from numpy import cos

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, phase
from drill_env.effects.signal import response


@response
def upper_unbalance(p, e, s, out):
    """torque cos(theta_u + phase)."""
    out.torque_u += e.q[0] * cos(s.theta_u + e.q[1])


EFFECT = Effect(
    component="upper",
    equation="upper",
    depends_on="theta_u",
    parameters=(amplitude("torque", "Nm", 0.02, most=HEAVIEST, signed=False), phase()),
    kernel=upper_unbalance,
    autonomous=False,
    neighbours=("encoder_eccentricity_upper", "gear_eccentricity", "upper_spring"),
    axis_only=True,
    common=True,
)
