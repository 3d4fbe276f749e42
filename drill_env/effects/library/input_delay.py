"""The voltage acts late."""

from drill_env.effects._effect import Effect, shape
from drill_env.effects._signal import at_start, response

HISTORY = 600


@response
def input_delay(p, q, m, s, out):
    """km (u(t - delay) - u(t))."""
    count = int(m[601])
    if s.first:
        m[0] = at_start(s)
        count = 1
    start = count - HISTORY + 1 if count >= HISTORY else 0
    m[count % HISTORY] = s.u
    m[601] = count + 1.0
    back = q[0] / s.dt
    whole = int(back)
    share = back - whole
    near, far = max(count - whole, start), max(count - whole - 1, start)
    mean = (1.0 - share) * m[near % HISTORY] + share * m[far % HISTORY]
    out.torque_u += p.km * (mean - s.u)


EFFECT = Effect(
    id="input_delay",
    component="actuator",
    equation="upper",
    depends_on="voltage",
    parameters=(
        shape(
            "delay",
            "s",
            (
                0.01,
                0.015,
                0.02,
                0.03,
                0.04,
                0.06,
                0.08,
                0.12,
                0.16,
                0.2,
                0.3,
            ),
            low=0.0,
            high=0.5,
        ),
    ),
    formula="km (u(t - delay) - u(t))",
    meaning="The voltage acts late.",
    kernel=input_delay,
    neighbours=(
        "actuator_lag",
        "slew_limit",
    ),
    aliases=("encoder_delay_both",),
)
