"""The motor's torque follows the voltage with a lag."""

from math import exp

from drill_env.effects._effect import Effect, shape
from drill_env.effects._signal import at_start, response


@response
def actuator_lag(p, q, m, s, out):
    """km (v - u), time_constant dv/dt = u - v."""
    v = at_start(s) if s.first else m[0]
    tau = q[0]
    decay = exp(-s.dt / tau)
    out.torque_u += p.km * (v - s.u) * tau / s.dt * (1.0 - decay)
    m[0] = s.u + (v - s.u) * decay


EFFECT = Effect(
    id="actuator_lag",
    component="actuator",
    equation="upper",
    depends_on="voltage",
    parameters=(
        shape(
            "time_constant",
            "s",
            (
                0.004,
                0.008,
                0.015,
                0.03,
                0.05,
                0.08,
                0.12,
                0.2,
                0.3,
                0.5,
            ),
            low=0.0001,
            high=20.0,
        ),
    ),
    formula="km (v - u), time_constant dv/dt = u - v",
    meaning="The motor's torque follows the voltage with a lag.",
    kernel=actuator_lag,
    neighbours=(
        "input_delay",
        "slew_limit",
        "gear_compliance",
    ),
)
