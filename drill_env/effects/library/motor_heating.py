"""The motor loses torque as it warms."""

from drill_env.effects._effect import Effect, amplitude, shape
from drill_env.effects.signal import response


@response
def motor_heating(p, e, s, out):
    """-km loss h u, time_constant dh/dt = u^2/(9 V^2) - h."""
    if s.first:
        e.z[0] = 0.0
    out.volts -= e.q[0] * e.z[0] * s.u
    e.rate[0] = (s.u * s.u / 9.0 - e.z[0]) / e.q[1]


EFFECT = Effect(
    component="actuator",
    equation="upper",
    depends_on="time",
    parameters=(
        amplitude("loss", "1", 0.05, most=0.9, signed=False),
        shape("time_constant", "s", (5.0, 10.0, 20.0, 40.0, 80.0, 200.0), low=2.0, high=10000.0),
    ),
    kernel=motor_heating,
    states=1,
    neighbours=("friction_warmup", "motor_fade"),
)
