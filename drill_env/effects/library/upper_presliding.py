"""The upper disc yields elastically before it slides (Dahl)."""

from math import exp

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, shape
from drill_env.effects._signal import RESTING, left_over, response, sign


@response
def upper_presliding(p, q, m, s, out):
    """(sign(omega_u) - z) torque, distance dz/dt = omega_u (1 - sign(omega_u) z)."""
    side = sign(s.omega_u) if s.omega_u != 0.0 else sign(s.net_u - m[0] * q[0])
    if s.first:
        # At rest nothing has built up.
        m[0] = 0.0 if abs(s.omega_u) < RESTING else side
    shares = abs(s.omega_u) * s.dt / q[1]
    out.torque_u += (side - m[0]) * q[0] * left_over(shares)
    m[0] = side + (m[0] - side) * exp(-shares)


EFFECT = Effect(
    id="upper_presliding",
    component="upper",
    equation="upper",
    depends_on="theta_u",
    parameters=(
        amplitude("torque", "Nm", 0.1, most=HEAVIEST, signed=False),
        shape(
            "distance",
            "rad",
            (
                4e-6,
                1e-5,
                2e-5,
                5e-5,
                1e-4,
                3e-4,
                1e-3,
                5e-3,
                0.02,
                0.1,
            ),
            low=1e-7,
            high=3.0,
        ),
    ),
    formula="(sign(omega_u) - z) torque, distance dz/dt = omega_u (1 - sign(omega_u) z)",
    meaning="The upper disc yields elastically before it slides (Dahl).",
    kernel=upper_presliding,
    neighbours=("upper_friction_lag",),
    axis_only=True,
    source="Dahl, Aerospace Corp. TOR-0158 (1968)",
    at_rest=True,
)
