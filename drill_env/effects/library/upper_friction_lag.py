"""The upper disc's Coulomb friction follows a reversal late."""

from math import exp

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, shape
from drill_env.effects._signal import RESTING, left_over, response, sign


@response
def upper_friction_lag(p, q, m, s, out):
    """(sign(omega_u) - z) torque, time_constant dz/dt = sign(omega_u) - z."""
    side = sign(s.omega_u) if s.omega_u != 0.0 else sign(s.net_u)
    if s.first:
        # At rest nothing has built up.
        m[0] = 0.0 if abs(s.omega_u) < RESTING else side
    shares = s.dt / q[1]
    # The mean over the held interval: the lag may be as short as that.
    out.torque_u += (side - m[0]) * q[0] * left_over(shares)
    m[0] = side + (m[0] - side) * exp(-shares)


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
    neighbours=("upper_presliding", "gear_compliance", "actuator_lag"),
    axis_only=True,
    source="Hess and Soom, J. Tribology 112 (1990)",
    at_rest=True,
)
