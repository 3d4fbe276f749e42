"""A gear runs out of true."""

from math import cos

from drill_env._jit import kernel
from drill_env.effects._effect import Effect, amplitude, phase, shape


@kernel
def gear_eccentricity(p, q, m, s, out):
    """torque cos(order theta_u + phase)."""
    out.torque_u += q[0] * cos(q[2] * s.theta_u + q[1])


EFFECT = Effect(
    id="gear_eccentricity",
    component="upper",
    equation="upper",
    depends_on="theta_u",
    parameters=(
        amplitude("torque", "Nm", 0.02, most=5.0, signed=False),
        phase(),
        shape(
            "order",
            "1",
            (
                1.0,
                2.0,
                3.0,
                4.0,
                5.0,
                6.0,
                7.0,
                8.0,
                10.0,
                12.0,
                15.0,
                20.0,
            ),
            low=0.2,
            high=500.0,
        ),
    ),
    formula="torque cos(order theta_u + phase)",
    meaning="A gear runs out of true.",
    kernel=gear_eccentricity,
    neighbours=("torque_ripple",),
)
