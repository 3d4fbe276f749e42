"""The string's own inertia gives a second torsional mode."""

from math import pi

from drill_env.effects._effect import Effect, shape
from drill_env.effects._signal import response


@response
def string_inertia(p, q, m, s, out):
    """2 ktheta z on both, d2z/dt2 = -(domega_u/dt + domega_l/dt)/2 - w^2 z - 2 damping w dz/dt."""
    wave = 2.0 * pi * q[0]
    h, loss = s.dt / 20.0, 2.0 * q[1] * wave
    total = 0.0
    for _ in range(20):
        m[1] += h * (-0.5 * (s.alpha_u + s.alpha_l) - wave * wave * m[0] - loss * m[1])
        m[0] += h * m[1]
        total += m[0]
    out.torque_u += 2.0 * p.ktheta * total / 20.0
    out.torque_l += 2.0 * p.ktheta * total / 20.0


EFFECT = Effect(
    id="string_inertia",
    component="string",
    equation="both",
    depends_on="omega_l",
    parameters=(
        shape(
            "frequency",
            "Hz",
            (
                1.0,
                1.103,
                1.216,
                1.341,
                1.478,
                1.63,
                1.798,
                1.982,
                2.186,
                2.41,
                2.658,
                2.93,
                3.231,
                3.563,
                3.929,
                4.332,
                4.777,
                5.268,
                5.809,
                6.405,
                7.063,
                7.788,
                8.588,
                9.47,
                10.442,
                11.514,
                12.696,
                14.0,
            ),
            low=0.3,
            high=100.0,
            form=0.0,
        ),
        shape("damping", "1", (0.02,), low=0.0005, high=2.0),
    ),
    formula="2 ktheta z on both, "
    "d2z/dt2 = -(domega_u/dt + domega_l/dt)/2 - w^2 z - 2 damping w dz/dt, w = 2 pi frequency",
    meaning="The string's own inertia gives a second torsional mode.",
    kernel=string_inertia,
    neighbours=("string_damping",),
)
