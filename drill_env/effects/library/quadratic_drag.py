"""The lower disc meets a drag that grows with the square of its speed."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude
from drill_env.effects.signal import response


@response
def quadratic_drag(p, e, s, out):
    """-coefficient |omega_l| omega_l."""
    out.torque_l -= e.q[0] * s.side_l * s.omega_l * s.omega_l


EFFECT = Effect(
    id="quadratic_drag",
    component="lower",
    equation="lower",
    depends_on="omega_l",
    parameters=(amplitude("coefficient", "Nm s^2/rad^2", 5e-05, most=HEAVIEST, signed=False),),
    formula="-coefficient |omega_l| omega_l",
    meaning="The lower disc meets a drag that grows with the square of its speed.",
    kernel=quadratic_drag,
    neighbours=(
        "whirl_drag",
        "lower_stribeck",
    ),
)
