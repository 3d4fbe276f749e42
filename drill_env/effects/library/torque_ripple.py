"""The motor's torque ripples with its angle (cogging)."""

from numpy import cos

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, phase, shape
from drill_env.effects.signal import response

ORDERS = (
    2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 14.0, 15.0, 16.0, 18.0, 20.0, 21.0,
    22.0, 24.0, 27.0, 28.0, 30.0, 32.0, 33.0, 36.0, 40.0, 44.0, 48.0,
)  # fmt: skip
"""Cycles a turn that motors have."""


@response
def torque_ripple(p, e, s, out):
    """torque cos(order theta_u + phase)."""
    out.torque_u += e.q[0] * cos(e.q[2] * s.theta_u + e.q[1])


EFFECT = Effect(
    component="actuator",
    equation="upper",
    depends_on="theta_u",
    parameters=(
        amplitude("torque", "Nm", 0.02, most=HEAVIEST, signed=False),
        phase(),
        shape("order", "1", ORDERS, low=1.5, high=500.0, form=0.0),
    ),
    kernel=torque_ripple,
    autonomous=False,
    neighbours=("gear_eccentricity",),
)
