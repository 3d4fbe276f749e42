"""A body on a spring, such as a frame, swings at the lower disc."""

from drill_env.effects._effect import Effect
from drill_env.effects._resonator import NUMBERS, swing
from drill_env.effects.signal import response


@response
def lower_resonator(p, e, s, out):
    """share Jl (w^2 z + 2 damping w dz/dt), d2z/dt2 = -w^2 z - 2 damping w dz/dt - domega_l/dt."""
    out.torque_l += swing(e, s, s.omega_l, p.Jl)


EFFECT = Effect(
    component="lower",
    equation="lower",
    depends_on="omega_l",
    parameters=NUMBERS,
    formula="share Jl (w^2 z + 2 damping w dz/dt), "
    "d2z/dt2 = -w^2 z - 2 damping w dz/dt - domega_l/dt, w = 2 pi frequency",
    kernel=lower_resonator,
    states=2,
    neighbours=("string_inertia", "string_damping"),
)
