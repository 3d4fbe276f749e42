"""The brake disc is not flat: friction changes with its angle."""

from math import cos

from drill_env.effects._effect import Effect, amplitude, phase, shape
from drill_env.effects._signal import against, response


@response
def brake_runout(p, q, m, s, out):
    """-runout cos(order theta_l + phase) T_fl."""
    out.torque_l += against(s.omega_l, s.net_l, q[0] * cos(q[2] * s.theta_l + q[1]) * s.friction_l)


EFFECT = Effect(
    id="brake_runout",
    component="lower",
    equation="lower",
    depends_on="theta_l",
    parameters=(
        amplitude("runout", "1", 0.05, most=0.99, signed=False),
        phase(),
        shape(
            "order",
            "1",
            (
                1.0,
                2.0,
                3.0,
                4.0,
            ),
            low=0.2,
            high=100.0,
            form=0.0,
        ),
    ),
    formula="-runout cos(order theta_l + phase) T_fl",
    meaning="The brake disc is not flat: friction changes with its angle.",
    kernel=brake_runout,
    friction=True,
    neighbours=("unbalance",),
)
