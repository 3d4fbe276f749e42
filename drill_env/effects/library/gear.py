"""Between the motor and the upper disc."""

from functools import partial
from math import pi

import numpy as np
from numpy import cos

from drill_env._jit import kernel
from drill_env._types import FloatArray
from drill_env.effects._effect import amplitude, effect, phase, shape
from drill_env.effects.signal import branch
from drill_env.friction.kernels import upper_sliding

upper = partial(effect, "upper")

_GAPS = (0.002, 0.006, 0.02, 0.04, 0.08, 0.15, 0.25, 0.4, 0.6, 0.9)
_FREQUENCIES = (0.9, 1.5, 2.4, 3.8, 6.0, 9.5, 15.0, 24.0, 38.0)

MOTOR_SHARE = shape("motor_share", "1", (0.1, 0.25, 0.5), low=0.01, high=0.95, form=0.25)
"""Of the upper disc's inertia. Only where the disc is released and held does it show."""

FRICTION_SHARE = shape("friction_share", "1", (0.05, 1.0), low=0.01, high=1.0, form=0.5)
"""Of the drive's friction that sits at the motor and not at the disc: rigs differ."""

# Forms as found on development and opened cases of the proof's maker: what shows only while a
# disc is released, held or met by the other flank of a tooth is estimated badly.
DAMPING = shape("damping", "1", (0.07,), low=0.002, high=2.0, form=0.15)
"""Of the gear's ringing, as a share of critical."""

# Where teeth meet, most gears do not ring: half of critical, between the two ways.
IMPACT_DAMPING = shape("damping", "1", (0.07, 0.5), low=0.002, high=2.0, form=0.15)
"""Of the ringing of teeth in contact, as a share of critical."""


def same_motor(q: FloatArray, times: float, share: int, frequency: int) -> FloatArray:
    """A gear's numbers where motor and disc together have so many times the inertia.

    Motor and spring are the same. `share` is the place of the motor's share of the inertia,
    `frequency` that of the ringing; the damping is the last number.
    """
    out = q.copy()
    out[share] = q[share] / times
    faster = np.sqrt((1.0 - q[share]) / (1.0 - out[share]))
    out[frequency], out[-1] = q[frequency] * faster, q[-1] * faster
    return out


@kernel
def wind(p, e, s, share, frequency, damping, gap):
    """Torque (Nm) that the gear hands on.

    e.z[0] is the motor's angle ahead of the disc, e.z[1] its speed. `frequency` (Hz) is that of
    the motor against the disc: recordings tell it, and hardly the stiffness and the motor's
    `share` of the inertia that it comes from. `damping` is a share of critical, `gap` the play in
    rad.
    """
    if s.first:
        e.z[1] = s.omega_u
    reduced = share * p.Ju * (1.0 - share)
    stiffness = (2.0 * pi * frequency) ** 2 * reduced
    loss = 4.0 * pi * damping * frequency * reduced
    slip = e.z[1] - s.omega_u
    if gap == 0.0:
        return stiffness * e.z[0] + loss * slip
    for side in range(2):
        towards = 1.0 - 2.0 * side
        wound = towards * e.z[0] - 0.5 * gap
        push = stiffness * wound + loss * towards * slip
        meets, pushes = branch(e, s, 1 + side, wound), 1
        # Teeth push and never pull; on which side of that they are matters in contact alone.
        if meets > 0:
            pushes = branch(e, s, 3, push)
        if meets > 0 and pushes > 0:
            return towards * push
        if meets > 0:
            return 0.0
    return 0.0


@kernel
def choose_motor(e, s, ahead, held):
    """Direction of the motor where no event tells it: it stops where it passes rest and is held."""
    speed = e.z[1].real
    if s.first or s.choose > 1:
        e.side[0] = 1 if speed > 0.0 else (-1 if speed < 0.0 else 0)
    if e.side[0] * speed <= 0.0:
        if held.real >= 0.0:
            e.side[0] = 0
            e.z[1] = 0.0
        else:
            e.side[0] = ahead if speed == 0.0 or e.side[0] == 0 else (1 if speed > 0.0 else -1)


@kernel
def turn_motor(p, e, s, out, share, torque, at_motor):
    """Rates of the motor's angle and speed; its share of the friction holds it like a disc's."""
    push, last = p.km * (s.u + out.volts) - torque, e.switches - 1
    # What holds it on either side: only so is it between the two of a disc at rest, where the push
    # may differ in its sign.
    forward = at_motor * upper_sliding(p, 1, 0.0) - push
    backward = push - at_motor * upper_sliding(p, -1, 0.0)
    if e.side[last] != 0:
        e.side[0], e.side[last] = -1, 0
    if s.choose:
        ahead = 1 if push.real >= 0.0 else -1
        choose_motor(e, s, ahead, forward if ahead > 0 else backward)
    side = e.side[0]
    e.rate[0] = e.z[1] - s.omega_u
    if side != 0:
        e.gap[0], e.next[0] = side * e.z[1], 0
        left = push - at_motor * upper_sliding(p, side, e.z[1])
        e.rate[1] = left / (share * p.Ju)
    else:
        e.gap[0], e.next[0], e.rate[1] = forward, 1, 0.0
        e.gap[last], e.next[last] = backward, -1
        if s.settle:
            e.z[1] = 0.0


@kernel
def drive_through(p, e, s, out, share, torque, at_motor):
    """The motor behind its gear takes the place of the voltage's torque on the disc."""
    turn_motor(p, e, s, out, share, torque, at_motor)
    out.drive = 0.0
    out.torque_u += torque
    out.scale_u -= at_motor
    out.inertia_u -= share * p.Ju


@upper(
    "voltage",
    "The drive has play: the motor moves free for a while.",
    shape("gap", "rad", _GAPS, low=0.0001, high=6.0, form=0.12),
    MOTOR_SHARE,
    shape("frequency", "Hz", (3.0, 9.5, 30.0, 80.0), low=0.5, high=200.0, form=0.003),
    FRICTION_SHARE,
    IMPACT_DAMPING,
    formula="motor behind play and a spring: J_m dw_m/dt = km u - T_g - friction_share T_fu; "
    "without play the two would ring at `frequency`",
    states=2,
    switches=5,
    neighbours=("amplifier_deadzone", "gear_compliance"),
    replaces_balance=True,
    refined_within=True,
    limit=("gap", "gear_compliance"),
    heavier=partial(same_motor, share=1, frequency=2),
)
def gear_backlash(p, e, s, out):
    """motor behind play and a spring: J_m dw_m/dt = km u - T_g - friction_share T_fu."""
    torque = wind(p, e, s, e.q[1], e.q[2], e.q[4], e.q[0])
    drive_through(p, e, s, out, e.q[1], torque, e.q[3])


@upper(
    "voltage",
    "The drive's gear is springy.",
    shape("frequency", "Hz", _FREQUENCIES, low=0.1, high=200.0, form=0.003),
    MOTOR_SHARE,
    FRICTION_SHARE,
    DAMPING,
    formula="motor_share J_u behind a spring: J_m dw_m/dt = km u - T_g - friction_share T_fu; "
    "the two ring at `frequency`",
    states=2,
    switches=2,
    neighbours=("actuator_lag", "gear_backlash", "upper_resonator"),
    replaces_balance=True,
    refined_within=True,
    heavier=partial(same_motor, share=1, frequency=0),
)
def gear_compliance(p, e, s, out):
    """motor_share J_u behind a spring: J_m dw_m/dt = km u - T_g - friction_share T_fu."""
    torque = wind(p, e, s, e.q[1], e.q[0], e.q[3], 0.0)
    drive_through(p, e, s, out, e.q[1], torque, e.q[2])


@upper(
    "theta_u",
    "A gear runs out of true: the drive's torque varies once a turn.",
    amplitude("eccentricity", "1", 0.02, most=1.0, signed=False),
    phase(),
    neighbours=("torque_ripple", "encoder_eccentricity_upper"),
)
def gear_eccentricity(p, e, s, out):
    """km u eccentricity cos(theta_u + phase)."""
    out.volts += s.u * e.q[0] * cos(s.theta_u + e.q[1])
