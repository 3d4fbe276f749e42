"""Something outside shakes the lower disc at a fixed frequency."""

from math import pi

from numpy import cos

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, phase, shape
from drill_env.effects.signal import response


@response
def lower_disturbance(p, e, s, out):
    """torque cos(2 pi frequency t + phase)."""
    out.torque_l += e.q[0] * cos(2.0 * pi * e.q[2] * s.t + e.q[1])


EFFECT = Effect(
    component="lower",
    equation="lower",
    depends_on="time",
    parameters=(
        amplitude("torque", "Nm", 0.0005, most=HEAVIEST, signed=False),
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
    kernel=lower_disturbance,
    autonomous=False,
    swings="frequency",
)
