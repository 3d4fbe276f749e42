"""The upper disc rubs at every speed alike (Coulomb)."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude
from drill_env.effects.signal import response


@response
def upper_coulomb(p, e, s, out):
    """-sign(omega_u) torque."""
    out.size_u += e.q[0]


EFFECT = Effect(
    component="upper",
    equation="upper",
    depends_on="omega_u",
    parameters=(amplitude("torque", "Nm", 0.1, most=HEAVIEST, signed=False),),
    kernel=upper_coulomb,
    neighbours=("upper_stribeck", "upper_viscous"),
    stands_for="Tsu",
    at_rest=True,
    common=True,
)
