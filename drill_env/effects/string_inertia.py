"""The string's own inertia gives a second torsional mode."""

from math import pi

from drill_env._jit import kernel
from drill_env.effects._effect import Effect, shape


@kernel
def string_inertia(p, q, m, s, out):
    """2 ktheta z on both, d2z/dt2 = -(domega_u/dt + domega_l/dt)/2 - (2 pi frequency)^2 z."""
    wave = 2.0 * pi * q[0]
    h = s.dt / 20.0
    total = 0.0
    for _ in range(20):
        m[1] += h * (-0.5 * (s.alpha_u + s.alpha_l) - wave * wave * m[0] - 0.04 * wave * m[1])
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
                1.4,
                2.0,
                3.0,
                4.5,
                7.0,
                11.0,
            ),
            low=0.3,
            high=100.0,
        ),
    ),
    formula="2 ktheta z on both, d2z/dt2 = -(domega_u/dt + domega_l/dt)/2 - (2 pi frequency)^2 z",
    meaning="The string's own inertia gives a second torsional mode.",
    kernel=string_inertia,
    neighbours=("string_damping",),
)
