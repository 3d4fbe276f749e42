"""The lower encoder reports late."""

from drill_env._jit import kernel
from drill_env.effects._effect import Effect, amplitude


@kernel
def encoder_delay_lower(p, q, m, s, out):
    """theta_l(t - delay) - theta_l(t) on the reading."""
    out.angle_l -= q[0] * (s.omega_l - 0.5 * q[0] * s.alpha_l)


EFFECT = Effect(
    id="encoder_delay_lower",
    component="sensor",
    equation="lower",
    depends_on="omega_l",
    parameters=(amplitude("delay", "s", 0.005, most=0.5),),
    formula="theta_l(t - delay) - theta_l(t) on the reading",
    meaning="The lower encoder reports late.",
    kernel=encoder_delay_lower,
    neighbours=("string_damping",),
    senses=True,
)
