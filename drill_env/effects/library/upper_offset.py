"""A constant torque acts on the upper disc, or its Coulomb friction differs with direction."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude
from drill_env.effects.signal import response


@response
def upper_offset(p, e, s, out):
    """-torque."""
    out.torque_u -= e.q[0]


EFFECT = Effect(
    component="upper",
    equation="upper",
    depends_on="time",
    parameters=(amplitude("torque", "Nm", 0.02, most=HEAVIEST),),
    meaning="A constant torque acts on the upper disc, or its Coulomb friction differs with "
    "direction, which is the same.",
    kernel=upper_offset,
    neighbours=("upper_asymmetry", "gain_asymmetry"),
    stands_for="dTsu",
    common=True,
)
