"""Between the motor and the upper disc."""

from numpy import cos

from drill_env.effects._drive import DAMPING, FRICTION_SHARE, MOTOR_SHARE, drive_through, wind
from drill_env.effects._effect import amplitude, effect, phase, shape


@effect(
    "upper",
    "voltage",
    "The drive has play: the motor moves free for a while.",
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
    formula="motor behind play and a spring: J_m dw_m/dt = km u - T_g - friction_share T_fu; "
    "without play the two would ring at `frequency`",
    states=2,
    switches=4,
    neighbours=("amplifier_deadzone", "gear_compliance"),
    replaces_balance=True,
    refined_within=True,
    limit=("gap", "gear_compliance"),
)
def gear_backlash(p, e, s, out):
    """motor behind play and a spring: J_m dw_m/dt = km u - T_g - friction_share T_fu."""
    torque = wind(p, e, s, e.q[1], e.q[2], e.q[4], e.q[0])
    drive_through(p, e, s, out, e.q[1], torque, e.q[3])


@effect(
    "upper",
    "voltage",
    "The drive's gear is springy.",
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
    formula="motor_share J_u behind a spring: J_m dw_m/dt = km u - T_g - friction_share T_fu; "
    "the two ring at `frequency`",
    states=2,
    switches=1,
    neighbours=("actuator_lag", "gear_backlash", "upper_resonator"),
    replaces_balance=True,
    refined_within=True,
)
def gear_compliance(p, e, s, out):
    """motor_share J_u behind a spring: J_m dw_m/dt = km u - T_g - friction_share T_fu."""
    torque = wind(p, e, s, e.q[1], e.q[0], e.q[3], 0.0)
    drive_through(p, e, s, out, e.q[1], torque, e.q[2])


@effect(
    "upper",
    "theta_u",
    "A gear runs out of true: the drive's torque varies once a turn.",
    amplitude("eccentricity", "1", 0.02, most=1.0, signed=False),
    phase(),
    autonomous=False,
    neighbours=("torque_ripple", "encoder_eccentricity_upper"),
)
def gear_eccentricity(p, e, s, out):
    """km u eccentricity cos(theta_u + phase)."""
    out.volts += s.u * e.q[0] * cos(s.theta_u + e.q[1])
