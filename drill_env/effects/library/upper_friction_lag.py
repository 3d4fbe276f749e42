"""The upper disc's Coulomb friction follows a reversal late."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, shape
from drill_env.effects.signal import RESTING, branch, response


@response
def upper_friction_lag(p, e, s, out):
    """(sign(omega_u) - z) torque, time_constant dz/dt = sign(omega_u) - z."""
    side = s.side_u
    if s.rest_u:
        side = branch(e, s, 0, p.km * s.u - s.pull)
    if s.first:
        # At rest nothing has built up.
        e.z[0] = 0.0 if abs(s.omega_u) < RESTING else side
    out.size_u -= e.q[0]
    out.torque_u -= e.q[0] * e.z[0]
    e.rate[0] = (side - e.z[0]) / e.q[1]


EFFECT = Effect(
    id="upper_friction_lag",
    component="upper",
    equation="upper",
    depends_on="omega_u",
    parameters=(
        amplitude("torque", "Nm", 0.1, most=HEAVIEST, signed=False),
        shape(
            "time_constant",
            "s",
            (
                0.001,
                0.002,
                0.005,
                0.01,
                0.02,
                0.05,
                0.1,
            ),
            low=1e-4,
            high=5.0,
        ),
    ),
    formula="(sign(omega_u) - z) torque, time_constant dz/dt = sign(omega_u) - z",
    meaning="The upper disc's Coulomb friction follows a reversal late.",
    kernel=upper_friction_lag,
    states=1,
    switches=1,
    neighbours=("upper_presliding", "gear_compliance", "actuator_lag"),
    axis_only=True,
    source="Hess and Soom, J. Tribology 112 (1990)",
    at_rest=True,
)
