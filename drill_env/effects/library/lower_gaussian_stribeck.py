"""The brake grips harder near rest, and gives way with the square of speed."""

from numpy import exp

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, shape
from drill_env.effects.signal import response


@response
def lower_gaussian_stribeck(p, e, s, out):
    """-sign(omega_l) torque exp(-(omega_l/velocity)^2)."""
    share = s.speed_l / e.q[1]
    out.size_l += e.q[0] * exp(-share * share)


EFFECT = Effect(
    component="lower",
    equation="lower",
    depends_on="omega_l",
    parameters=(
        amplitude("torque", "Nm", 0.001, most=HEAVIEST, signed=False),
        shape(
            "velocity", "rad/s", (0.03, 0.1, 0.3, 0.6, 1.2, 2.5), low=0.001, form=0.02, high=20.0
        ),
    ),
    kernel=lower_gaussian_stribeck,
    neighbours=("lower_stribeck", "dwell_stiction", "friction_lag"),
    source="Armstrong-Helouvry, Control of Machines with Friction (1991)",
    at_rest=True,
)
