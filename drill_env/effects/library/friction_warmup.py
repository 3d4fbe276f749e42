"""The upper bearing's friction falls as it warms."""

from numpy import exp

from drill_env.effects._effect import Effect, amplitude, shape
from drill_env.effects.signal import response


@response
def friction_warmup(p, e, s, out):
    """-excess e^(-t/time_constant) T_fu."""
    out.scale_u += e.q[0] * exp(-s.t / e.q[1])


EFFECT = Effect(
    component="upper",
    equation="upper",
    depends_on="time",
    parameters=(
        amplitude("excess", "1", 0.05, most=3.0, signed=False),
        shape("time_constant", "s", (3.0, 6.0, 12.0, 25.0, 50.0, 100.0), low=2.0, high=1000.0),
    ),
    kernel=friction_warmup,
    autonomous=False,
    neighbours=("motor_heating",),
    rigs_own_if_slow=True,
)
