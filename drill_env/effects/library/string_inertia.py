"""The string's own inertia gives a second torsional mode."""

from math import pi

from drill_env.effects._effect import Effect, shape
from drill_env.effects.signal import response

_FREQUENCIES = (
    0.503, 0.555, 0.612, 0.675, 0.745, 0.822, 0.907, 1.0, 1.103, 1.216, 1.341, 1.478, 1.63, 1.798,
    1.982, 2.186, 2.41, 2.658, 2.93, 3.231, 3.563, 3.929, 4.332, 4.777, 5.268, 5.809, 6.405, 7.063,
    7.788, 8.588, 9.47, 10.442, 11.514, 12.696, 14.0,
)  # fmt: skip


@response
def string_inertia(p, e, s, out):
    """2 ktheta z on both, d2z/dt2 = -(domega_u/dt + domega_l/dt)/2 - w^2 z - 2 damping w dz/dt."""
    middle = 0.5 * (s.omega_u + s.omega_l)
    if s.first:
        e.z[0], e.z[1] = 0.0, middle
    # The second state is dz/dt + middle, so that no acceleration is asked for.
    wave, rate = 2.0 * pi * e.q[0], e.z[1] - middle
    e.rate[0] = rate
    e.rate[1] = -wave * wave * e.z[0] - 2.0 * e.q[1] * wave * rate
    out.torque_u += 2.0 * p.ktheta * e.z[0]
    out.torque_l += 2.0 * p.ktheta * e.z[0]


EFFECT = Effect(
    component="string",
    equation="both",
    depends_on="omega_l",
    parameters=(
        shape("frequency", "Hz", _FREQUENCIES, low=0.3, high=100.0, form=0.0),
        shape("damping", "1", (0.02, 0.1), low=0.0005, high=2.0),
    ),
    formula="2 ktheta z on both, "
    "d2z/dt2 = -(domega_u/dt + domega_l/dt)/2 - w^2 z - 2 damping w dz/dt, w = 2 pi frequency",
    kernel=string_inertia,
    states=2,
    neighbours=("string_damping", "lower_resonator"),
)
