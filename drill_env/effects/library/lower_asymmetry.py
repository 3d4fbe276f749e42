"""The brake rubs harder in one direction."""

from drill_env.effects._effect import Effect, amplitude
from drill_env.effects.signal import response


@response
def lower_asymmetry(p, e, s, out):
    """-asymmetry T_l(|omega_l|)."""
    out.scale_l += e.q[0] * s.side_l


EFFECT = Effect(
    component="lower",
    equation="lower",
    depends_on="omega_l",
    parameters=(amplitude("asymmetry", "1", 0.02, most=0.95),),
    kernel=lower_asymmetry,
    neighbours=("lower_disturbance",),
)
