"""The brake's friction falls as it warms."""

from math import exp

from drill_env.effects._effect import Effect, amplitude, shape
from drill_env.effects._signal import against, response


@response
def friction_heating(p, q, m, s, out):
    """loss h T_fl, time_constant dh/dt = T_l |omega_l|/(0.5 W) - h."""
    power = s.friction_l * abs(s.omega_l) / 0.5
    m[0] = power + (m[0] - power) * exp(-s.dt / q[1])
    out.torque_l += against(s.omega_l, s.net_l, -q[0] * m[0] * s.friction_l)


EFFECT = Effect(
    id="friction_heating",
    component="lower",
    equation="lower",
    depends_on="time",
    parameters=(
        amplitude("loss", "1", 0.05, most=0.95, signed=False),
        shape(
            "time_constant",
            "s",
            (
                3.0,
                6.0,
                12.0,
                25.0,
                50.0,
                120.0,
            ),
            low=2.0,
            high=10000.0,
        ),
    ),
    formula="loss h T_fl, time_constant dh/dt = T_l |omega_l|/(0.5 W) - h",
    meaning="The brake's friction falls as it warms.",
    kernel=friction_heating,
    friction=True,
    neighbours=(
        "friction_drift",
        "wear",
    ),
)
