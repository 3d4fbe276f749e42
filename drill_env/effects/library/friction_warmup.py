"""The upper bearing's friction falls as it warms."""

from math import exp

from drill_env.effects._effect import Effect, amplitude, shape
from drill_env.effects._signal import against, response


@response
def friction_warmup(p, q, m, s, out):
    """-excess e^(-t/time_constant) T_fu."""
    extra = q[0] * exp(-s.t / q[1]) * s.friction_u
    out.torque_u += against(s.omega_u, s.net_u, extra)


EFFECT = Effect(
    id="friction_warmup",
    component="upper",
    equation="upper",
    depends_on="time",
    parameters=(
        amplitude("excess", "1", 0.05, most=3.0, signed=False),
        shape(
            "time_constant",
            "s",
            (
                3.0,
                6.0,
                12.0,
                25.0,
                50.0,
                100.0,
            ),
            low=2.0,
            high=1000.0,
        ),
    ),
    formula="-excess e^(-t/time_constant) T_fu",
    meaning="The upper bearing's friction falls as it warms.",
    kernel=friction_warmup,
    friction=True,
    neighbours=("motor_heating",),
    rigs_own_if_slow=True,
)
