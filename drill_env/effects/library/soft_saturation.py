"""The drive gives way little by little as it comes to its limit, as iron saturates."""

from drill_env.effects._effect import Effect, shape
from drill_env.effects.signal import response, size_of


@response
def soft_saturation(p, e, s, out):
    """km (u/(1 + |u/level|^(1/softness))^softness - u)."""
    size = size_of(e, s, 0, s.u) / e.q[0]
    # At 0 the power has no complex derivative, and there is nothing to add.
    if size.real > 0.0:
        out.volts += s.u / (1.0 + size ** (1.0 / e.q[1])) ** e.q[1] - s.u


EFFECT = Effect(
    component="actuator",
    equation="upper",
    depends_on="voltage",
    parameters=(
        shape("level", "V", (1.0, 2.0, 3.0, 4.0, 5.0), low=0.05, high=1000.0),
        shape("softness", "1", (0.5, 0.2), low=0.02, high=2.0),
    ),
    kernel=soft_saturation,
    switches=1,
    limit=("softness", "amplifier_saturation"),
    neighbours=("amplifier_saturation", "supply_sag"),
)
