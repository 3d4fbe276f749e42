"""The supply gives way under load."""

from drill_env.effects._effect import Effect, amplitude
from drill_env.effects._signal import response


@response
def supply_sag(p, q, m, s, out):
    """-km sag |u| u."""
    out.torque_u -= p.km * q[0] * abs(s.u) * s.u


EFFECT = Effect(
    id="supply_sag",
    component="actuator",
    equation="upper",
    depends_on="voltage",
    parameters=(amplitude("sag", "1/V", 0.01, most=0.19, signed=False),),
    formula="-km sag |u| u",
    meaning="The supply gives way under load.",
    kernel=supply_sag,
    steady=True,
    neighbours=(
        "amplifier_saturation",
        "upper_quadratic_drag",
    ),
)
