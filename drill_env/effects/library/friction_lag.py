"""The brake's torque follows the speed late."""

from math import exp

from drill_env.effects._effect import Effect, shape
from drill_env.effects._signal import against, left_over, response, sign
from drill_env.friction._kernels import lower_sliding


@response
def friction_lag(p, q, m, s, out):
    """-sign(omega_l) (T_l(w) - T_l(|omega_l|)), time_constant dw/dt = |omega_l| - w."""
    speed, rate = abs(s.omega_l), s.alpha_l * sign(s.omega_l)
    if s.first:
        m[0] = speed
    # Along a speed that changes evenly, for the lag may be shorter than the held interval.
    begin = speed - 0.5 * rate * s.dt
    behind = m[0] - begin + rate * q[0]
    shares = s.dt / q[0]
    mean = speed - rate * q[0] + behind * left_over(shares)
    m[0] = begin + rate * (s.dt - q[0]) + behind * exp(-shares)
    extra = lower_sliding(p, max(mean, 0.0)) - s.friction_l
    out.torque_l += against(s.omega_l, s.net_l, extra)


EFFECT = Effect(
    id="friction_lag",
    component="lower",
    equation="lower",
    depends_on="omega_l",
    parameters=(
        shape(
            "time_constant",
            "s",
            (
                0.005,
                0.01,
                0.02,
                0.04,
                0.08,
                0.15,
                0.3,
                0.6,
            ),
            low=0.0005,
            high=20.0,
        ),
    ),
    formula="-sign(omega_l) (T_l(w) - T_l(|omega_l|)), time_constant dw/dt = |omega_l| - w",
    meaning="The brake's torque follows the speed late.",
    kernel=friction_lag,
    friction=True,
    neighbours=(
        "rate_state",
        "presliding",
        "string_damping",
    ),
    source="Hess and Soom, J. Tribology 112 (1990)",
    at_rest=True,
)
