"""Compiled effect without a name: a piecewise linear function of one coordinate."""

from math import floor

from drill_env._jit import inlined, kernel
from drill_env.effects._signal import against

COORDINATES = (
    "time",
    "voltage",
    "theta_u",
    "theta_l",
    "twist",
    "omega_u",
    "omega_l",
    "omega_u - omega_l",
)
TIME, VOLTAGE, THETA_U, THETA_L, TWIST, OMEGA_U, OMEGA_L = range(7)

ACTIONS = (
    "torque_u", "torque_l", "string", "friction_u", "friction_l", "angle_u", "angle_l", "drive_u",
    "damping_u", "damping", "stiffness",
)  # fmt: skip
(
    TORQUE_U, TORQUE_L, STRING, FRICTION_U, FRICTION_L, ANGLE_U, ANGLE_L, DRIVE_U, DAMPING_U,
    DAMPING,
) = range(10)  # fmt: skip

COORDINATE, ACTION, COUNT, PERIOD = range(4)


@inlined
def coordinate_of(which, s):
    """Value of coordinate number `which`."""
    if which == TIME:
        return s.t
    if which == VOLTAGE:
        return s.u
    if which == THETA_U:
        return s.theta_u
    if which == THETA_L:
        return s.theta_l
    if which == TWIST:
        return s.twist
    if which == OMEGA_U:
        return s.omega_u
    if which == OMEGA_L:
        return s.omega_l
    return s.omega_u - s.omega_l


@inlined
def within(x, period):
    """The coordinate within one period; as it is where the period is 0."""
    return x - period * floor(x / period) if period > 0.0 else x


@inlined
def interpolate(table, count, x):
    """Value at `x` between knots table[0] with values table[1]; constant beyond the ends."""
    low, high = 0, count - 1
    if x <= table[0, low]:
        return table[1, low]
    if x >= table[0, high]:
        return table[1, high]
    while high - low > 1:
        middle = (low + high) // 2
        if x < table[0, middle]:
            high = middle
        else:
            low = middle
    share = (x - table[0, low]) / (table[0, high] - table[0, low])
    return table[1, low] + share * (table[1, high] - table[1, low])


@kernel
def tabulated(p, q, table, s, out):
    """Add the table's torque or error; `q` holds its coordinate, action, length and period."""
    x = within(coordinate_of(int(q[COORDINATE]), s), q[PERIOD])
    value = interpolate(table, int(q[COUNT]), x)
    action = int(q[ACTION])
    if action == TORQUE_U:
        out.torque_u += value
    elif action == TORQUE_L:
        out.torque_l += value
    elif action == STRING:
        out.torque_u -= value
        out.torque_l += value
    elif action == FRICTION_U:
        out.torque_u += against(s.omega_u, s.net_u, value)
    elif action == FRICTION_L:
        out.torque_l += against(s.omega_l, s.net_l, value * s.friction_l)
    elif action == ANGLE_U:
        out.angle_u += value
    elif action == ANGLE_L:
        out.angle_l += value
    elif action == DRIVE_U:
        out.torque_u += p.km * s.u * value
    elif action == DAMPING_U:
        out.torque_u -= value * s.omega_u
    else:
        pull = value * (s.omega_u - s.omega_l if action == DAMPING else p.ktheta * s.twist)
        out.torque_u -= pull
        out.torque_l += pull
