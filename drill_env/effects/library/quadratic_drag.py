"""The lower disc meets a drag that grows with the square of its speed."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude
from drill_env.effects.signal import response


@response
def quadratic_drag(p, e, s, out):
    """-coefficient |omega_l| omega_l."""
    out.torque_l -= e.q[0] * s.side_l * s.omega_l * s.omega_l


EFFECT = Effect(
    component="lower",
    equation="lower",
    depends_on="omega_l",
    parameters=(amplitude("coefficient", "Nm s^2/rad^2", 5e-05, most=HEAVIEST, signed=False),),
    kernel=quadratic_drag,
    neighbours=("whirl_drag", "lower_stribeck"),
)
