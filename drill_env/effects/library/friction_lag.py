"""The brake's torque follows the speed late."""

from drill_env.effects._effect import Effect, shape
from drill_env.effects.signal import response


@response
def friction_lag(p, e, s, out):
    """-sign(omega_l) (T_l(w) - T_l(|omega_l|)), time_constant dw/dt = |omega_l| - w."""
    if s.first:
        e.z[0] = s.speed_l
    out.read_l += e.z[0] - s.speed_l
    e.rate[0] = (s.speed_l - e.z[0]) / e.q[0]


EFFECT = Effect(
    component="lower",
    equation="lower",
    depends_on="omega_l",
    parameters=(
        shape(
            "time_constant",
            "s",
            (0.005, 0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.6),
            low=0.0005,
            high=20.0,
        ),
    ),
    kernel=friction_lag,
    states=1,
    neighbours=("rate_state", "presliding", "string_damping"),
    source="Hess and Soom, J. Tribology 112 (1990)",
    at_rest=True,
)
