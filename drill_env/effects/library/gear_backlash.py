"""The drive has play: the motor moves free for a while."""

from drill_env.effects._drive import DAMPING, FRICTION_SHARE, MOTOR_SHARE, drive_through, wind
from drill_env.effects._effect import Effect, shape
from drill_env.effects.signal import response


@response
def gear_backlash(p, e, s, out):
    """motor behind play and a spring: J_m dw_m/dt = km u - T_g - friction_share T_fu."""
    torque = wind(p, e, s, e.q[1], e.q[2], e.q[4], e.q[0])
    drive_through(p, e, s, out, e.q[1], torque, e.q[3])


EFFECT = Effect(
    component="upper",
    equation="upper",
    depends_on="voltage",
    parameters=(
        shape(
            "gap",
            "rad",
            (0.002, 0.006, 0.02, 0.04, 0.08, 0.15, 0.25, 0.4, 0.6, 0.9),
            low=0.0001,
            high=6.0,
            form=0.12,
        ),
        MOTOR_SHARE,
        shape("frequency", "Hz", (3.0, 9.5, 30.0), low=0.5, high=200.0, form=0.003),
        FRICTION_SHARE,
        DAMPING,
    ),
    formula="motor behind play and a spring: J_m dw_m/dt = km u - T_g - friction_share T_fu; "
    "without play the two would ring at `frequency`",
    kernel=gear_backlash,
    states=2,
    switches=4,
    replaces_balance=True,
    refined_within=True,
    limit=("gap", "gear_compliance"),
    neighbours=("amplifier_deadzone", "gear_compliance"),
)
