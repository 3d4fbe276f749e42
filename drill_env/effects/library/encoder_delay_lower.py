"""The lower encoder reports late."""

from drill_env.effects._effect import Effect, shape
from drill_env.effects.signal import response


@response
def encoder_delay_lower(p, e, s, out):
    """theta_l(t - delay) - theta_l(t) on the reading."""
    out.angle_l += e.theta_l_late - s.theta_l


EFFECT = Effect(
    component="sensor",
    equation="lower",
    depends_on="omega_l",
    parameters=(shape("delay", "s", (0.01, 0.02, 0.03, 0.05, 0.08, 0.12), low=0.0, high=0.5),),
    kernel=encoder_delay_lower,
    delay="delay",
    neighbours=("string_damping",),
    senses=True,
)
