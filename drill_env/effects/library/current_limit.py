"""The drive limits its current, and the motor's torque with it."""

from drill_env.effects._effect import Effect, shape
from drill_env.effects.signal import clipped, response


@response
def current_limit(p, e, s, out):
    """km (clip(v, -level, level) - v), v = u - back_emf omega_u."""
    left = s.u - e.q[1] * s.omega_u
    out.volts += clipped(e, s, 0, left, -e.q[0], e.q[0]) - left


EFFECT = Effect(
    component="actuator",
    equation="upper",
    depends_on="voltage",
    parameters=(
        shape("level", "V", (0.6, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5), low=0.02, high=200.0),
        shape("back_emf", "V s/rad", (0.25, 0.5), low=0.0, high=100.0),
    ),
    kernel=current_limit,
    switches=2,
    neighbours=("amplifier_saturation", "supply_sag", "motor_heating"),
)
