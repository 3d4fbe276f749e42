"""The string's clamp has play."""

from drill_env.effects._effect import Effect, shape
from drill_env.effects._signal import response


@response
def string_play(p, q, m, s, out):
    """+-ktheta clip(twist, -gap/2, gap/2)."""
    torque = -p.ktheta * min(max(s.twist, -0.5 * q[0]), 0.5 * q[0])
    out.torque_l += torque
    out.torque_u -= torque


EFFECT = Effect(
    id="string_play",
    component="string",
    equation="both",
    depends_on="twist",
    parameters=(
        shape(
            "gap",
            "rad",
            (
                0.02,
                0.05,
                0.1,
                0.15,
                0.2,
                0.3,
                0.45,
                0.6,
            ),
            low=0.001,
            form=0.05,
            high=20.0,
        ),
    ),
    formula="+-ktheta clip(twist, -gap/2, gap/2)",
    meaning="The string's clamp has play.",
    kernel=string_play,
    neighbours=(
        "string_hardening",
        "lower_stribeck",
    ),
)
