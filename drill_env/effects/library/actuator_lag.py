"""The motor's torque follows the voltage with a lag."""

from drill_env.effects._effect import Effect, shape
from drill_env.effects.signal import at_start, response


@response
def actuator_lag(p, e, s, out):
    """km (v - u), time_constant dv/dt = u - v."""
    if s.first:
        e.z[0] = at_start(s)
    out.volts += e.z[0] - s.u
    e.rate[0] = (s.u - e.z[0]) / e.q[0]


EFFECT = Effect(
    component="actuator",
    equation="upper",
    depends_on="voltage",
    parameters=(
        shape(
            "time_constant",
            "s",
            (0.004, 0.008, 0.015, 0.03, 0.05, 0.08, 0.12, 0.2, 0.3, 0.5),
            low=0.0001,
            high=20.0,
        ),
    ),
    kernel=actuator_lag,
    states=1,
    neighbours=("input_delay", "slew_limit", "gear_compliance"),
)
