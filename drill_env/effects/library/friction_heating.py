"""The brake's friction falls as it warms."""

from drill_env.effects._effect import Effect, amplitude, shape
from drill_env.effects.signal import response


@response
def friction_heating(p, e, s, out):
    """loss h T_fl, time_constant dh/dt = T_l |omega_l|/(0.5 W) - h."""
    if s.first:
        e.z[0] = 0.0
    out.scale_l -= e.q[0] * e.z[0]
    e.rate[0] = (s.friction_l * s.speed_l / 0.5 - e.z[0]) / e.q[1]


EFFECT = Effect(
    component="lower",
    equation="lower",
    depends_on="time",
    parameters=(
        amplitude("loss", "1", 0.05, most=0.95, signed=False),
        shape("time_constant", "s", (3.0, 6.0, 12.0, 25.0, 50.0, 120.0), low=2.0, high=10000.0),
    ),
    kernel=friction_heating,
    states=1,
    neighbours=("friction_drift", "wear", "friction_settling"),
)
