"""The brake yields elastically before it slides (Dahl)."""

from math import exp

from drill_env.effects._effect import Effect, shape
from drill_env.effects._signal import left_over, response, sign


@response
def presliding(p, q, m, s, out):
    """(sign(omega_l) - z) T_l, distance dz/dt = omega_l (1 - sign(omega_l) z)."""
    if s.first:
        m[0] = 0.0
    # Where it turns round, what it yielded to pushes it back.
    side = sign(s.omega_l) if s.omega_l != 0.0 else sign(s.net_l - m[0] * s.friction_l)
    shares = abs(s.omega_l) * s.dt / q[0]
    # The mean over the held interval: the way to yield may be far shorter than the disc's in it.
    out.torque_l += (side - m[0]) * left_over(shares) * s.friction_l
    m[0] = side + (m[0] - side) * exp(-shares)


EFFECT = Effect(
    id="presliding",
    component="lower",
    equation="lower",
    depends_on="theta_l",
    parameters=(
        shape(
            "distance",
            "rad",
            (
                0.005,
                0.01,
                0.02,
                0.04,
                0.08,
                0.15,
                0.3,
            ),
            low=0.0002,
            high=3.0,
        ),
    ),
    formula="(sign(omega_l) - z) T_l, distance dz/dt = omega_l (1 - sign(omega_l) z)",
    meaning="The brake yields elastically before it slides (Dahl).",
    kernel=presliding,
    friction=True,
    neighbours=(
        "friction_lag",
        "string_hysteresis",
    ),
    source="Dahl, Aerospace Corp. TOR-0158 (1968)",
    at_rest=True,
)
