"""The upper encoder loses counts when it turns fast."""

from drill_env.effects._effect import Effect, amplitude, shape
from drill_env.effects._signal import response


@response
def missed_counts_upper(p, q, m, s, out):
    """-share of the way above the speed on the reading."""
    if not s.first and abs(s.omega_u) > q[1]:
        m[0] += s.omega_u * s.dt
    out.angle_u -= q[0] * m[0]


EFFECT = Effect(
    id="missed_counts_upper",
    component="sensor",
    equation="upper",
    depends_on="omega_u",
    parameters=(
        amplitude("share", "1", 0.001, most=0.5, signed=False),
        shape(
            "speed",
            "rad/s",
            (
                2.0,
                4.0,
                6.0,
                8.0,
                10.0,
            ),
            low=0.0,
            high=100.0,
        ),
    ),
    formula="-share of the way above the speed on the reading",
    meaning="The upper encoder loses counts when it turns fast.",
    kernel=missed_counts_upper,
    senses=True,
)
