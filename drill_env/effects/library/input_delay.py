"""The voltage acts late."""

from drill_env.effects._effect import Effect, shape
from drill_env.effects.signal import response


@response
def input_delay(p, e, s, out):
    """km (u(t - delay) - u(t))."""
    out.volts += e.u_late - s.u


EFFECT = Effect(
    component="actuator",
    equation="upper",
    depends_on="voltage",
    parameters=(
        shape(
            "delay",
            "s",
            (0.01, 0.015, 0.02, 0.03, 0.04, 0.06, 0.08, 0.12, 0.16, 0.2, 0.3),
            low=0.0,
            high=0.5,
        ),
    ),
    kernel=input_delay,
    passing=True,
    delay="delay",
    neighbours=("actuator_lag", "slew_limit"),
    aliases=("encoder_delay_both",),
)
