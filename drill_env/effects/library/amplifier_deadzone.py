"""The amplifier ignores small voltages."""

from drill_env.effects._effect import Effect, shape
from drill_env.effects.signal import clipped, response


@response
def amplifier_deadzone(p, e, s, out):
    """-km clip(u, -width, width)."""
    out.volts -= clipped(e, s, 0, s.u, -e.q[0], e.q[0])


EFFECT = Effect(
    component="actuator",
    equation="upper",
    depends_on="voltage",
    parameters=(
        shape(
            "width",
            "V",
            (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0),
            low=0.0001,
            high=10.0,
        ),
    ),
    kernel=amplifier_deadzone,
    switches=2,
    neighbours=("upper_stribeck", "gear_backlash"),
)
