"""The string is stiffer in one direction."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude
from drill_env.effects._signal import response


@response
def string_asymmetry(p, q, m, s, out):
    """-+coefficient |twist|."""
    torque = q[0] * abs(s.twist)
    out.torque_l += torque
    out.torque_u -= torque


EFFECT = Effect(
    id="string_asymmetry",
    component="string",
    equation="both",
    depends_on="twist",
    parameters=(amplitude("coefficient", "Nm/rad", 0.002, most=HEAVIEST),),
    formula="-+coefficient |twist|",
    meaning="The string is stiffer in one direction.",
    kernel=string_asymmetry,
    steady=True,
    neighbours=(
        "string_hardening",
        "load_dependent_friction",
    ),
)
