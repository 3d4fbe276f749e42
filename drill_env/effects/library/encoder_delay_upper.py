"""The upper encoder reports late."""

from drill_env.effects._effect import Effect, shape
from drill_env.effects.signal import response


@response
def encoder_delay_upper(p, e, s, out):
    """theta_u(t - delay) - theta_u(t) on the reading."""
    out.angle_u += e.theta_u_late - s.theta_u


EFFECT = Effect(
    component="sensor",
    equation="upper",
    depends_on="omega_u",
    parameters=(shape("delay", "s", (0.01, 0.02, 0.03, 0.05, 0.08, 0.12), low=0.0, high=0.5),),
    kernel=encoder_delay_upper,
    delay="delay",
    neighbours=("input_delay",),
    senses=True,
)
