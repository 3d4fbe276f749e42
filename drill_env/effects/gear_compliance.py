"""The drive's gear is springy."""

from drill_env._jit import kernel
from drill_env.effects._drive import DAMPING, FRICTION_SHARE, MOTOR_SHARE, drive_torque
from drill_env.effects._effect import Effect, shape


@kernel
def gear_compliance(p, q, m, s, out):
    """motor_share J_u behind a spring: J_m dw_m/dt = km u - T_g - friction_share T_fu."""
    out.torque_u += drive_torque(p, m, s, q[1], q[0], 0.0, q[2], q[3])


EFFECT = Effect(
    id="gear_compliance",
    component="upper",
    equation="upper",
    depends_on="voltage",
    parameters=(
        shape(
            "stiffness",
            "Nm/rad",
            (
                3.0,
                8.0,
                20.0,
                50.0,
                120.0,
                300.0,
                800.0,
                2000.0,
                5000.0,
            ),
            low=0.1,
            high=100000.0,
        ),
        MOTOR_SHARE,
        FRICTION_SHARE,
        DAMPING,
    ),
    formula="motor_share J_u behind a spring: J_m dw_m/dt = km u - T_g - friction_share T_fu",
    meaning="The drive's gear is springy.",
    kernel=gear_compliance,
    neighbours=(
        "actuator_lag",
        "gear_backlash",
    ),
)
