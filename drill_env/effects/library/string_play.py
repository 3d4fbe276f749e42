"""The string's clamp has play."""

from drill_env.effects._effect import Effect, shape
from drill_env.effects.signal import clipped, response


@response
def string_play(p, e, s, out):
    """+-ktheta clip(twist, -gap/2, gap/2)."""
    out.string -= p.ktheta * clipped(e, s, 0, s.twist, -0.5 * e.q[0], 0.5 * e.q[0])


EFFECT = Effect(
    component="string",
    equation="both",
    depends_on="twist",
    parameters=(
        shape(
            "gap",
            "rad",
            (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.45, 0.6),
            low=0.001,
            form=0.05,
            high=20.0,
        ),
    ),
    kernel=string_play,
    switches=2,
    neighbours=("string_hardening", "lower_stribeck"),
)
