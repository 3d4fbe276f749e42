"""A body on a spring that swings at a disc."""

from math import pi

from drill_env._jit import kernel
from drill_env.effects._effect import amplitude, shape

NUMBERS = (
    shape(
        "frequency",
        "Hz",
        (0.3, 0.44, 0.64, 0.94, 1.4, 2.0, 3.0, 4.3, 6.4, 9.3, 14.0, 20.0),
        low=0.05,
        high=200.0,
        form=0.0,
    ),
    amplitude("share", "1", 0.05, most=5.0, signed=False),
    shape("damping", "1", (0.02,), low=0.0005, high=2.0),
)
"""The body's own frequency with the disc held, its share of the disc's inertia, and its damping."""


@kernel
def swing(e, s, omega, inertia):
    """Torque (Nm) of the body on a disc of `inertia` that turns at `omega`.

    e.z[0] is the body's angle ahead of the disc, e.z[1] its own speed, so that no acceleration is
    asked for.
    """
    if s.first:
        e.z[0], e.z[1] = 0.0, omega
    wave, slip = 2.0 * pi * e.q[0], e.z[1] - omega
    pull = wave * wave * e.z[0] + 2.0 * e.q[2] * wave * slip
    e.rate[0], e.rate[1] = slip, -pull
    return e.q[1] * inertia * pull
