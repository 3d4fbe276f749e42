"""The motor as an inertia of its own, behind a spring that may have play."""

from drill_env._jit import kernel
from drill_env.effects._signal import sign

SUBSTEPS = 20
# Of critical: gears ring for some periods.
DAMPING = 0.1


@kernel
def motor_speed(p, omega, push, inertia, h):
    """Speed of the motor after `h` s under a torque and the drive's whole friction."""
    side = sign(omega)
    if side == 0.0:
        side = sign(push)
        if side == 0.0 or side * push <= p.Tsu + side * p.dTsu:
            return 0.0
    drag = side * p.Tsu + p.dTsu + (p.bu + side * p.dbu) * omega
    new = omega + h * (push - drag) / inertia
    return 0.0 if new * side < 0.0 else new


@kernel
def drive_torque(p, m, s, share, stiffness, gap):
    """Torque (Nm) that the rig's lumped upper disc lacks against one with a motor behind a spring.

    The friction sits at the motor. m[0] is the motor's angle ahead of the disc, m[1] its speed.
    """
    inertia = share * p.Ju
    if s.first:
        m[0], m[1] = 0.0, s.omega_u
    h = s.dt / SUBSTEPS
    loss = 2.0 * DAMPING * (stiffness * inertia) ** 0.5
    total = 0.0
    for i in range(SUBSTEPS):
        omega_u = s.omega_u + s.alpha_u * ((i + 0.5) * h - 0.5 * s.dt)
        wound = m[0] - min(max(m[0], -0.5 * gap), 0.5 * gap)
        torque = 0.0
        if wound != 0.0:
            torque = stiffness * wound + loss * (m[1] - omega_u)
        total += torque
        m[1] = motor_speed(p, m[1], p.km * s.u - torque, inertia, h)
        m[0] += h * (m[1] - omega_u)
    pull = p.ktheta * s.twist
    friction = sign(s.omega_u) * s.friction_u
    if s.omega_u == 0.0:
        friction = min(max(s.net_u, -s.friction_u), s.friction_u)
    return (total / SUBSTEPS - pull) / (1.0 - share) - (s.net_u - friction)
