"""The upper bearing rubs harder under the string's torque."""

from drill_env.effects._effect import Effect, amplitude
from drill_env.effects._signal import against, response


@response
def load_dependent_friction(p, q, m, s, out):
    """-sign(omega_u) coefficient |ktheta twist|."""
    out.torque_u += against(s.omega_u, s.net_u, q[0] * abs(p.ktheta * s.twist))


EFFECT = Effect(
    id="load_dependent_friction",
    component="upper",
    equation="upper",
    depends_on="twist",
    parameters=(amplitude("coefficient", "1", 0.05, most=5.0, signed=False, form=0.04),),
    formula="-sign(omega_u) coefficient |ktheta twist|",
    meaning="The upper bearing rubs harder under the string's torque.",
    kernel=load_dependent_friction,
    friction=True,
    steady=True,
    neighbours=("string_asymmetry",),
)
