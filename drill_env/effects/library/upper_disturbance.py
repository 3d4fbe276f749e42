"""Something outside shakes the upper disc at a fixed frequency."""

from math import pi

from numpy import cos

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, phase, shape
from drill_env.effects.signal import response


@response
def upper_disturbance(p, e, s, out):
    """torque cos(2 pi frequency t + phase)."""
    out.torque_u += e.q[0] * cos(2.0 * pi * e.q[2] * s.t + e.q[1])


EFFECT = Effect(
    component="upper",
    equation="upper",
    depends_on="time",
    parameters=(
        amplitude("torque", "Nm", 0.02, most=HEAVIEST, signed=False),
        phase(),
        shape(
            "frequency",
            "Hz",
            (0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.5, 6.5, 10.0, 15.0),
            low=0.005,
            high=200.0,
            form=0.0,
        ),
    ),
    kernel=upper_disturbance,
    autonomous=False,
    swings="frequency",
)
