"""The drive's gear is springy."""

from drill_env.effects._drive import DAMPING, FRICTION_SHARE, MOTOR_SHARE, drive_through, wind
from drill_env.effects._effect import Effect, shape
from drill_env.effects.signal import response


@response
def gear_compliance(p, e, s, out):
    """motor_share J_u behind a spring: J_m dw_m/dt = km u - T_g - friction_share T_fu."""
    torque = wind(p, e, s, e.q[1], e.q[0], e.q[3], 0.0)
    drive_through(p, e, s, out, e.q[1], torque, e.q[2])


EFFECT = Effect(
    component="upper",
    equation="upper",
    depends_on="voltage",
    parameters=(
        shape(
            "frequency",
            "Hz",
            (0.9, 1.5, 2.4, 3.8, 6.0, 9.5, 15.0, 24.0, 38.0),
            low=0.1,
            high=200.0,
            form=0.003,
        ),
        MOTOR_SHARE,
        FRICTION_SHARE,
        DAMPING,
    ),
    formula="motor_share J_u behind a spring: J_m dw_m/dt = km u - T_g - friction_share T_fu; "
    "the two ring at `frequency`",
    kernel=gear_compliance,
    states=2,
    switches=1,
    replaces_balance=True,
    refined_within=True,
    neighbours=("actuator_lag", "gear_backlash", "upper_resonator"),
)
