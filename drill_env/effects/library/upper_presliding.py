"""The upper disc yields elastically before it slides (Dahl)."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, shape
from drill_env.effects._yield import give_way
from drill_env.effects.signal import RESTING, response


@response
def upper_presliding(p, e, s, out):
    """(sign(omega_u) - z) torque, distance dz/dt = omega_u (1 - sign(omega_u) z)."""
    if s.first:
        # At rest nothing has built up.
        e.z[0] = 0.0 if abs(s.omega_u) < RESTING else s.side_u
    out.size_u -= e.q[0]
    out.torque_u -= e.q[0] * e.z[0]
    give_way(e, s, s.rest_u, s.omega_u, s.side_u, e.q[1])


EFFECT = Effect(
    component="upper",
    equation="upper",
    depends_on="theta_u",
    parameters=(
        amplitude("torque", "Nm", 0.1, most=HEAVIEST, signed=False),
        shape(
            "distance",
            "rad",
            (4e-6, 1e-5, 2e-5, 5e-5, 1e-4, 3e-4, 1e-3, 5e-3, 0.02, 0.1),
            low=1e-7,
            high=3.0,
        ),
    ),
    kernel=upper_presliding,
    states=1,
    switches=1,
    neighbours=("upper_friction_lag",),
    axis_only=True,
    source="Dahl, Aerospace Corp. TOR-0158 (1968)",
    at_rest=True,
)
