"""The brake rubs harder in one direction."""

from drill_env.effects._effect import Effect, amplitude
from drill_env.effects._signal import against, response, sign


@response
def lower_asymmetry(p, q, m, s, out):
    """-asymmetry T_l(|omega_l|)."""
    if s.omega_l != 0.0:
        out.torque_l -= q[0] * s.friction_l
    else:
        extra = q[0] * s.friction_l * sign(s.net_l)
        out.torque_l += against(0.0, s.net_l, extra)


EFFECT = Effect(
    id="lower_asymmetry",
    component="lower",
    equation="lower",
    depends_on="omega_l",
    parameters=(amplitude("asymmetry", "1", 0.02, most=0.95),),
    formula="-asymmetry T_l(|omega_l|)",
    meaning="The brake rubs harder in one direction.",
    kernel=lower_asymmetry,
    friction=True,
    steady=True,
    neighbours=("lower_disturbance",),
)
