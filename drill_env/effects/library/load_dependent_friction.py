"""The upper bearing rubs harder under the string's torque."""

from drill_env.effects._effect import Effect, amplitude
from drill_env.effects.signal import response, size_of


@response
def load_dependent_friction(p, e, s, out):
    """-sign(omega_u) coefficient |ktheta twist|."""
    out.size_u += e.q[0] * size_of(e, s, 0, s.pull)


EFFECT = Effect(
    component="upper",
    equation="upper",
    depends_on="twist",
    parameters=(amplitude("coefficient", "1", 0.05, most=5.0, signed=False, form=0.04),),
    kernel=load_dependent_friction,
    switches=1,
    neighbours=("string_asymmetry",),
)
