"""A spring, a cable or a hose pulls the upper disc back."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, shape
from drill_env.effects.signal import response


@response
def upper_spring(p, e, s, out):
    """-stiffness (theta_u - centre)."""
    out.torque_u -= e.q[0] * (s.theta_u - e.q[1])


EFFECT = Effect(
    component="upper",
    equation="upper",
    depends_on="theta_u",
    parameters=(
        amplitude("stiffness", "Nm/rad", 0.02, most=HEAVIEST, signed=False),
        shape("centre", "rad", (0.0,), low=-1000.0, high=1000.0, form=0.0),
    ),
    kernel=upper_spring,
    autonomous=False,
    neighbours=("upper_unbalance", "upper_offset"),
    axis_only=True,
)
