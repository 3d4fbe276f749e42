"""The upper disc is damped more in one direction than in the other."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude
from drill_env.effects.signal import response


@response
def upper_asymmetry(p, e, s, out):
    """-damping |omega_u|."""
    out.torque_u -= e.q[0] * s.side_u * s.omega_u


EFFECT = Effect(
    component="upper",
    equation="upper",
    depends_on="omega_u",
    parameters=(amplitude("damping", "Nm s/rad", 0.02, most=HEAVIEST),),
    kernel=upper_asymmetry,
    neighbours=("upper_offset", "gain_asymmetry"),
    stands_for="dbu",
)
