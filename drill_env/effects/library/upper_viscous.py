"""The upper disc is damped in proportion to its speed (viscous)."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude
from drill_env.effects.signal import response


@response
def upper_viscous(p, e, s, out):
    """-damping omega_u."""
    out.torque_u -= e.q[0] * s.omega_u


EFFECT = Effect(
    component="upper",
    equation="upper",
    depends_on="omega_u",
    parameters=(amplitude("damping", "Nm s/rad", 0.1, most=HEAVIEST, signed=False),),
    kernel=upper_viscous,
    neighbours=("upper_quadratic_drag", "upper_coulomb"),
    stands_for="bu",
    common=True,
)
