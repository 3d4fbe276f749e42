"""The lower disc meets a drag that grows with the square of its speed."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude
from drill_env.effects._signal import response


@response
def quadratic_drag(p, q, m, s, out):
    """-coefficient |omega_l| omega_l."""
    out.torque_l -= q[0] * abs(s.omega_l) * s.omega_l


EFFECT = Effect(
    id="quadratic_drag",
    component="lower",
    equation="lower",
    depends_on="omega_l",
    parameters=(amplitude("coefficient", "Nm s^2/rad^2", 5e-05, most=HEAVIEST, signed=False),),
    formula="-coefficient |omega_l| omega_l",
    meaning="The lower disc meets a drag that grows with the square of its speed.",
    kernel=quadratic_drag,
    steady=True,
    neighbours=(
        "whirl_drag",
        "lower_stribeck",
    ),
)
