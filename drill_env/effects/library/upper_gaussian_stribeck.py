"""The upper disc's friction is higher at low speed, and falls with the square of it."""

from numpy import exp

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, shape
from drill_env.effects.signal import response


@response
def upper_gaussian_stribeck(p, e, s, out):
    """-sign(omega_u) torque exp(-(omega_u/velocity)^2)."""
    share = s.speed_u / e.q[1]
    out.size_u += e.q[0] * exp(-share * share)


EFFECT = Effect(
    component="upper",
    equation="upper",
    depends_on="omega_u",
    parameters=(
        amplitude("torque", "Nm", 0.02, most=HEAVIEST, signed=False),
        shape("velocity", "rad/s", (0.05, 0.15, 0.4, 1.0, 2.5), low=0.001, high=20.0),
    ),
    kernel=upper_gaussian_stribeck,
    neighbours=("upper_stribeck", "amplifier_deadzone"),
    source="Armstrong-Helouvry, Control of Machines with Friction (1991)",
    at_rest=True,
)
