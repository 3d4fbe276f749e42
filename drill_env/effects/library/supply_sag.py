"""The supply gives way under load."""

from drill_env.effects._effect import Effect, amplitude
from drill_env.effects.signal import response, size_of


@response
def supply_sag(p, e, s, out):
    """-km sag |u| u."""
    out.volts -= e.q[0] * size_of(e, s, 0, s.u) * s.u


EFFECT = Effect(
    component="actuator",
    equation="upper",
    depends_on="voltage",
    parameters=(amplitude("sag", "1/V", 0.01, most=0.19, signed=False),),
    kernel=supply_sag,
    switches=1,
    neighbours=("amplifier_saturation", "upper_quadratic_drag"),
)
