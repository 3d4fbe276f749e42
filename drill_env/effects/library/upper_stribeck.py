"""The upper disc's friction is higher at low speed."""

from numpy import exp

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, shape
from drill_env.effects.signal import response


@response
def upper_stribeck(p, e, s, out):
    """-sign(omega_u) torque exp(-|omega_u|/velocity)."""
    out.size_u += e.q[0] * exp(-s.speed_u / e.q[1])


EFFECT = Effect(
    component="upper",
    equation="upper",
    depends_on="omega_u",
    parameters=(
        amplitude("torque", "Nm", 0.02, most=HEAVIEST, signed=False),
        shape("velocity", "rad/s", (0.03, 0.07, 0.15, 0.3, 0.6, 1.0, 1.6), low=0.001, high=20.0),
    ),
    kernel=upper_stribeck,
    neighbours=("upper_gaussian_stribeck", "amplifier_deadzone"),
    source="Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994)",
    at_rest=True,
)
