"""The brake yields elastically before it slides (Dahl)."""

from drill_env.effects._effect import Effect, shape
from drill_env.effects._yield import give_way
from drill_env.effects.signal import response


@response
def presliding(p, e, s, out):
    """(sign(omega_l) - z) T_l, distance dz/dt = omega_l (1 - sign(omega_l) z)."""
    if s.first:
        e.z[0] = 0.0
    # What it has yielded takes the place of the direction, and nothing sticks.
    out.scale_l -= 1.0
    out.torque_l -= e.z[0] * s.friction_l
    give_way(e, s, s.rest_l, s.omega_l, s.side_l, e.q[0])


EFFECT = Effect(
    component="lower",
    equation="lower",
    depends_on="theta_l",
    parameters=(
        shape("distance", "rad", (0.005, 0.01, 0.02, 0.04, 0.08, 0.15, 0.3), low=0.0002, high=3.0),
    ),
    kernel=presliding,
    states=1,
    switches=1,
    neighbours=("friction_lag", "string_hysteresis"),
    source="Dahl, Aerospace Corp. TOR-0158 (1968)",
    at_rest=True,
)
