"""The upper disc meets a drag that grows with the square of its speed."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude
from drill_env.effects.signal import response


@response
def upper_quadratic_drag(p, e, s, out):
    """-coefficient |omega_u| omega_u."""
    out.torque_u -= e.q[0] * s.side_u * s.omega_u * s.omega_u


EFFECT = Effect(
    component="upper",
    equation="upper",
    depends_on="omega_u",
    parameters=(amplitude("coefficient", "Nm s^2/rad^2", 0.005, most=HEAVIEST, signed=False),),
    kernel=upper_quadratic_drag,
    neighbours=("supply_sag",),
)
