"""The brake disc is not flat: friction changes with its angle."""

from numpy import cos

from drill_env.effects._effect import Effect, amplitude, phase, shape
from drill_env.effects.signal import response


@response
def brake_runout(p, e, s, out):
    """-runout cos(order theta_l + phase) T_fl."""
    out.scale_l += e.q[0] * cos(e.q[2] * s.theta_l + e.q[1])


EFFECT = Effect(
    component="lower",
    equation="lower",
    depends_on="theta_l",
    parameters=(
        amplitude("runout", "1", 0.05, most=0.99, signed=False),
        phase(),
        shape("order", "1", (1.0, 2.0, 3.0, 4.0), low=0.2, high=100.0, form=0.0),
    ),
    kernel=brake_runout,
    autonomous=False,
    neighbours=("unbalance",),
)
