"""The motor as an inertia of its own, behind a spring that may have play."""

from math import pi

from drill_env._jit import kernel
from drill_env.effects._effect import shape
from drill_env.effects._signal import sign

MOTOR_SHARE = shape("motor_share", "1", (0.1, 0.25, 0.5), low=0.01, high=0.95, form=0.25)
"""Of the upper disc's inertia. Only where the disc is released and held does it show."""

FRICTION_SHARE = shape("friction_share", "1", (0.05, 1.0), low=0.01, high=1.0, form=0.5)
"""Of the drive's friction that sits at the motor and not at the disc: rigs differ."""

# Forms as found on development and opened cases of the proof's maker: what is told by the moments
# at which a disc is released, held or met by the other flank of a tooth is told badly.
DAMPING = shape("damping", "1", (0.07,), low=0.002, high=2.0, form=0.15)
"""Of the gear's ringing, as a share of critical."""

# Of a held interval: as many as the ringing asks for.
FEWEST, MOST, IN_A_RADIAN = 6, 20, 8.0


@kernel
def resisted(omega, push, size):
    """Friction (Nm) against a speed, or what holds an inertia at rest against a push."""
    if omega != 0.0:
        return sign(omega) * size
    return min(max(push, -size), size)


@kernel
def drive_friction(p, omega):
    """Size (Nm) of the drive's whole friction at a speed."""
    side = sign(omega)
    return max(p.Tsu + side * p.dTsu + (p.bu + side * p.dbu) * abs(omega), 0.0)


@kernel
def drive_torque(p, m, s, share, frequency, gap, at_motor, damping):
    """Torque (Nm) that the rig's lumped upper disc lacks against one with a motor behind a spring.

    m[0] is the motor's angle ahead of the disc, m[1] its rate. Both follow from the voltage and
    the string's pull, not from the disc's measured motion: smoothing takes the gear's ringing out
    of that. `frequency` (Hz) is that of the motor against the disc: recordings tell it, and hardly
    the stiffness and `share` that it comes from. `at_motor` is the share of the friction that sits
    at the motor, `damping` the share of critical.
    """
    motor, disc = share * p.Ju, (1.0 - share) * p.Ju
    stiffness = (2.0 * pi * frequency) ** 2 * motor * (1.0 - share)
    substeps = max(FEWEST, min(MOST, int(IN_A_RADIAN * 2.0 * pi * frequency * s.dt) + 1))
    h = s.dt / substeps
    loss = 2.0 * damping * (stiffness * motor * (1.0 - share)) ** 0.5
    pull = p.ktheta * s.twist
    total = 0.0
    for _ in range(substeps):
        wound = m[0] - min(max(m[0], -0.5 * gap), 0.5 * gap)
        torque = 0.0
        if wound != 0.0:
            torque = stiffness * wound + loss * m[1]
            if gap > 0.0 and torque * wound < 0.0:
                # Teeth push and never pull.
                torque = 0.0
        on_disc = torque - pull
        on_disc -= resisted(s.omega_u, on_disc, (1.0 - at_motor) * s.friction_u)
        speed = s.omega_u + m[1]
        on_motor = p.km * s.u - torque
        if at_motor > 0.0:
            on_motor -= resisted(speed, on_motor, at_motor * drive_friction(p, speed))
        total += on_disc
        m[1] += h * (on_motor / motor - on_disc / disc)
        m[0] += h * m[1]
    friction = resisted(s.omega_u, s.net_u, s.friction_u)
    return total / substeps / (1.0 - share) - (s.net_u - friction)
