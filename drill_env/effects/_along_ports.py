"""Compiled torques that an effect's ports are, on discs whose motion is known."""

from drill_env._jit import inlined, kernel
from drill_env.effects.signal import clear_ports, respond
from drill_env.friction.kernels import lower_size


@inlined
def sign(value):
    """-1, 0 or 1."""
    return 1.0 if value > 0.0 else (-1.0 if value < 0.0 else 0.0)


@kernel
def set_motion(p, s, x, v, w, angle, u):
    """Signal of a state under a voltage, with what follows from both."""
    set_speeds(p, s, x, v, w, angle, u)
    s.friction_l = lower_size(p, s.speed_l)


@inlined
def set_speeds(p, s, x, v, w, angle, u):
    """The same but for the lower disc's friction, whose exponentials not every effect reads."""
    s.twist, s.omega_u, s.omega_l, s.theta_l, s.u = x, v, w, angle, u
    s.theta_u = angle + x
    s.pull = p.ktheta * x
    s.speed_u, s.speed_l = abs(v), abs(w)
    s.rest_u, s.rest_l = v == 0.0, w == 0.0
    s.side_u = sign(p.km * u - s.pull) if s.rest_u else sign(v)
    s.side_l = sign(s.pull) if s.rest_l else sign(w)
    side = 0.0 if s.rest_u else s.side_u
    s.friction_u = p.Tsu + side * p.dTsu + (p.bu + side * p.dbu) * s.speed_u


@inlined
def against(omega, net, torque):
    """The torque (Nm) with which additional friction of size `torque` acts on a disc.

    A resting disc is held by no more than what pulls on it; less friction pushes it on.
    """
    if omega != 0.0:
        return -sign(omega) * torque
    if torque >= 0.0:
        return -min(max(net, -torque), torque)
    return -sign(net) * torque


@inlined
def torque_on_upper(p, s, out):
    """What the ports are as a torque (Nm) on the rig's own upper disc."""
    plain = p.km * s.u - s.pull
    net = out.drive * p.km * (s.u + out.volts) + out.torque_u - s.pull - out.string
    more = s.friction_u * out.scale_u + out.size_u
    if out.drive == 1.0:
        return net - plain + against(s.omega_u, net + s.other_u, more)
    left = plain + against(s.omega_u, plain, s.friction_u)
    return p.Ju * acceleration_u(p, s, out) - left


@kernel
def acceleration_u(p, s, out):
    """Acceleration (rad/s^2) of the upper disc with what the ports are."""
    net = out.drive * p.km * (s.u + out.volts) + out.torque_u - s.pull - out.string
    size = s.friction_u * (1.0 + out.scale_u) + out.size_u
    return (net + against(s.omega_u, net, size)) / (p.Ju + out.inertia_u)


@inlined
def torque_on_lower(p, s, out):
    """What the ports are as a torque (Nm) on the rig's own lower disc."""
    more, extra = out.string + out.torque_l, out.size_l
    if out.scale_l != 0.0 or out.read_l != s.speed_l:
        extra += lower_size(p, out.read_l) * (1.0 + out.scale_l) - lower_size(p, s.speed_l)
    return more + against(s.omega_l, s.pull + more + s.other_l, extra)


@inlined
def ask(p, e, s, out):
    """Let the effect add to clear ports."""
    clear_ports(out, s)
    respond(e.code, p, e, s, out)
