"""The string stiffens with twist."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude
from drill_env.effects.signal import response


@response
def string_hardening(p, e, s, out):
    """-+coefficient twist^3."""
    out.string += e.q[0] * s.twist * s.twist * s.twist


EFFECT = Effect(
    component="string",
    equation="both",
    depends_on="twist",
    parameters=(amplitude("coefficient", "Nm/rad^3", 0.0001, most=HEAVIEST),),
    kernel=string_hardening,
    neighbours=("string_asymmetry",),
)
