"""The string is stiffer in one direction."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude
from drill_env.effects.signal import response, size_of


@response
def string_asymmetry(p, e, s, out):
    """-+coefficient |twist|."""
    out.string += e.q[0] * size_of(e, s, 0, s.twist)


EFFECT = Effect(
    component="string",
    equation="both",
    depends_on="twist",
    parameters=(amplitude("coefficient", "Nm/rad", 0.002, most=HEAVIEST),),
    kernel=string_asymmetry,
    switches=1,
    neighbours=("string_hardening", "load_dependent_friction"),
)
