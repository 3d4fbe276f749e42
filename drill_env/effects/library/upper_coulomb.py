"""The upper disc rubs with a force that does not depend on speed."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude
from drill_env.effects.signal import response


@response
def upper_coulomb(p, e, s, out):
    """-sign(omega_u) torque."""
    out.size_u += e.q[0]


EFFECT = Effect(
    id="upper_coulomb",
    component="upper",
    equation="upper",
    depends_on="omega_u",
    parameters=(amplitude("torque", "Nm", 0.1, most=HEAVIEST, signed=False),),
    formula="-sign(omega_u) torque",
    meaning="The upper disc rubs at every speed alike (Coulomb).",
    kernel=upper_coulomb,
    neighbours=("upper_stribeck", "upper_viscous"),
    stands_for="Tsu",
    at_rest=True,
    common=True,
)
