"""The motor's torque constant changes with its angle, as the current is commutated."""

from numpy import cos

from drill_env.effects._effect import Effect, amplitude, phase, shape
from drill_env.effects.library.torque_ripple import ORDERS
from drill_env.effects.signal import response


@response
def commutation_ripple(p, e, s, out):
    """km u depth cos(order theta_u + phase)."""
    out.volts += s.u * e.q[0] * cos(e.q[2] * s.theta_u + e.q[1])


EFFECT = Effect(
    component="actuator",
    equation="upper",
    depends_on="theta_u",
    parameters=(
        amplitude("depth", "1", 0.02, most=0.9, signed=False),
        phase(),
        shape("order", "1", ORDERS, low=1.5, high=500.0, form=0.0),
    ),
    kernel=commutation_ripple,
    autonomous=False,
    neighbours=("gear_eccentricity", "torque_ripple"),
)
