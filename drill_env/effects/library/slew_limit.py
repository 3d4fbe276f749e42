"""The amplifier changes its voltage no faster than a limit."""

from drill_env.effects._effect import Effect, shape
from drill_env.effects._signal import at_start, response, sign


@response
def slew_limit(p, q, m, s, out):
    """km (v - u), |dv/dt| <= rate, v follows u."""
    v = at_start(s) if s.first else m[0]
    gap, move = s.u - v, q[0] * s.dt
    if abs(gap) <= move:
        mean = s.u - 0.5 * gap * abs(gap) / move
        m[0] = s.u
    else:
        mean = v + 0.5 * sign(gap) * move
        m[0] = v + sign(gap) * move
    out.torque_u += p.km * (mean - s.u)


EFFECT = Effect(
    id="slew_limit",
    component="actuator",
    equation="upper",
    depends_on="voltage",
    parameters=(
        shape(
            "rate",
            "V/s",
            (
                2.0,
                4.0,
                7.0,
                10.0,
                15.0,
                20.0,
                30.0,
                45.0,
                70.0,
                100.0,
                150.0,
                250.0,
                400.0,
            ),
            low=0.1,
            high=100000.0,
        ),
    ),
    formula="km (v - u), |dv/dt| <= rate, v follows u",
    meaning="The amplifier changes its voltage no faster than a limit.",
    kernel=slew_limit,
    neighbours=(
        "actuator_lag",
        "input_delay",
    ),
)
