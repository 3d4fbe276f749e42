"""The amplifier delivers no more than a limit."""

from drill_env.effects._effect import Effect, shape
from drill_env.effects.signal import clipped, response

_LEVELS = (
    0.6, 0.8, 1.0, 1.25, 1.5, 1.75, 2.0, 2.25, 2.5, 2.75, 3.0, 3.25, 3.5, 3.75, 4.0, 4.25, 4.5,
    4.75, 4.9,
)  # fmt: skip


@response
def amplifier_saturation(p, e, s, out):
    """km (clip(u, -level, level) - u)."""
    out.volts += clipped(e, s, 0, s.u, -e.q[0], e.q[0]) - s.u


EFFECT = Effect(
    component="actuator",
    equation="upper",
    depends_on="voltage",
    parameters=(shape("level", "V", _LEVELS, low=0.05, high=100.0),),
    kernel=amplifier_saturation,
    switches=2,
    neighbours=("supply_sag", "slew_limit"),
)
