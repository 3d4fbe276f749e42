"""The brake grips harder near rest than the law says."""

from numpy import exp

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, shape
from drill_env.effects.signal import response


@response
def lower_stribeck(p, e, s, out):
    """-sign(omega_l) torque exp(-|omega_l|/velocity)."""
    out.size_l += e.q[0] * exp(-s.speed_l / e.q[1])


EFFECT = Effect(
    component="lower",
    equation="lower",
    depends_on="omega_l",
    parameters=(
        amplitude("torque", "Nm", 0.001, most=HEAVIEST, signed=False),
        shape(
            "velocity", "rad/s", (0.02, 0.05, 0.1, 0.2, 0.4, 0.8), low=0.001, form=0.02, high=20.0
        ),
    ),
    kernel=lower_stribeck,
    neighbours=("lower_gaussian_stribeck", "dwell_stiction", "friction_lag"),
    source="Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994)",
    at_rest=True,
)
