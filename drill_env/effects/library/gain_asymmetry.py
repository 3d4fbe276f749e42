"""The drive is stronger in one direction."""

from drill_env.effects._effect import Effect, amplitude
from drill_env.effects._signal import response


@response
def gain_asymmetry(p, q, m, s, out):
    """km asymmetry |u|."""
    out.torque_u += p.km * q[0] * abs(s.u)


EFFECT = Effect(
    id="gain_asymmetry",
    component="actuator",
    equation="upper",
    depends_on="voltage",
    parameters=(amplitude("asymmetry", "1", 0.02, most=0.9),),
    formula="km asymmetry |u|",
    meaning="The drive is stronger in one direction.",
    kernel=gain_asymmetry,
    steady=True,
    neighbours=("upper_quadratic_drag",),
)
