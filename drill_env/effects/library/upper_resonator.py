"""A body on a spring, such as a frame, swings at the upper disc."""

from drill_env.effects._effect import Effect
from drill_env.effects._resonator import NUMBERS, swing
from drill_env.effects.signal import response


@response
def upper_resonator(p, e, s, out):
    """share Ju (w^2 z + 2 damping w dz/dt), d2z/dt2 = -w^2 z - 2 damping w dz/dt - domega_u/dt."""
    out.torque_u += swing(e, s, s.omega_u, p.Ju)


EFFECT = Effect(
    component="upper",
    equation="upper",
    depends_on="omega_u",
    parameters=NUMBERS,
    formula="share Ju (w^2 z + 2 damping w dz/dt), "
    "d2z/dt2 = -w^2 z - 2 damping w dz/dt - domega_u/dt, w = 2 pi frequency",
    kernel=upper_resonator,
    states=2,
    neighbours=("gear_compliance", "string_inertia"),
)
