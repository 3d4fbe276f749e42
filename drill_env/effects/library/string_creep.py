"""The string creeps under load."""

from drill_env.effects._effect import Effect, amplitude, shape
from drill_env.effects.signal import response


@response
def string_creep(p, e, s, out):
    """+-compliance ktheta z, time_constant dz/dt = twist - z."""
    if s.first:
        e.z[0] = s.twist
    out.string -= e.q[0] * p.ktheta * e.z[0]
    e.rate[0] = (s.twist - e.z[0]) / e.q[1]


EFFECT = Effect(
    component="string",
    equation="both",
    depends_on="twist",
    parameters=(
        amplitude("compliance", "1", 0.03, most=0.9, signed=False),
        shape("time_constant", "s", (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0), low=0.02, high=1000.0),
    ),
    kernel=string_creep,
    states=1,
    neighbours=("string_hysteresis",),
)
