"""Drags that begin at a speed: a fluid that turns turbulent, a fan, a seal that lifts."""

from drill_env._jit import kernel
from drill_env.effects._effect import HEAVIEST, amplitude, effect, shape
from drill_env.effects.signal import branch


@kernel
def beyond(e, s, speed):
    """Square of what a speed is above e.q[1], rad^2/s^2."""
    over = speed - e.q[1]
    return over * over if branch(e, s, 0, over) > 0 else 0.0 * over


@effect(
    "upper",
    "omega_u",
    "Above a speed the upper disc meets a drag, which grows with the square of what is beyond.",
    amplitude("coefficient", "Nm s^2/rad^2", 0.02, most=HEAVIEST, signed=False),
    shape("speed", "rad/s", (0.5, 1.0, 2.0, 3.0, 4.5, 6.5), low=0.05, high=10000.0),
    switches=1,
    neighbours=("upper_quadratic_drag", "upper_viscous"),
)
def upper_drag_above_speed(p, e, s, out):
    """-sign(omega_u) coefficient (|omega_u| - speed)^2 where |omega_u| > speed."""
    out.torque_u -= e.q[0] * s.side_u * beyond(e, s, s.speed_u)


@effect(
    "lower",
    "omega_l",
    "Above a speed the lower disc meets a drag, which grows with the square of what is beyond.",
    amplitude("coefficient", "Nm s^2/rad^2", 5e-4, most=HEAVIEST, signed=False),
    shape("speed", "rad/s", (1.0, 2.0, 3.5, 5.0, 7.0, 10.0), low=0.05, high=10000.0),
    switches=1,
    neighbours=("quadratic_drag", "whirl_drag"),
)
def drag_above_speed(p, e, s, out):
    """-sign(omega_l) coefficient (|omega_l| - speed)^2 where |omega_l| > speed."""
    out.torque_l -= e.q[0] * s.side_l * beyond(e, s, s.speed_l)
