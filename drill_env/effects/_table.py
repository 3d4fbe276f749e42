"""Compiled effect without a name: a piecewise linear function of one coordinate."""

from math import floor, inf

from drill_env._intrinsics import number_at
from drill_env._jit import inlined, kernel
from drill_env.effects.signal import response

COORDINATES = (
    "time", "voltage", "theta_u", "theta_l", "twist", "omega_u", "omega_l", "omega_u - omega_l",
)  # fmt: skip

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
    slip = s.omega_u - s.omega_l
    return (s.t, s.u, s.theta_u, s.theta_l, s.twist, s.omega_u, s.omega_l, slip)[which]


@kernel
def knot(e, cell):
    """Place of a knot; those of a curve that comes back go on for ever."""
    count, period = int(e.q[COUNT].real), e.q[PERIOD].real
    if period > 0.0:
        turn = floor(cell / (count - 1.0))
        return number_at(e.table, int(cell - turn * (count - 1))) + turn * period
    if cell < 0:
        return -inf
    return inf if cell >= count else number_at(e.table, cell)


@kernel
def value_at_knot(e, cell):
    """Value at a knot, that of the nearest one beyond the ends."""
    count = int(e.q[COUNT].real)
    if e.q[PERIOD].real > 0.0:
        cell = int(cell - floor(cell / (count - 1.0)) * (count - 1))
    return number_at(e.table, count + min(max(cell, 0), count - 1))


@kernel
def cell_of(e, x):
    """Number of the last knot at or before `x`, -1 before the first."""
    count, period = int(e.q[COUNT].real), e.q[PERIOD].real
    turn = 0
    if period > 0.0:
        turn = int(floor((x - number_at(e.table, 0)) / period))
        x -= turn * period
    low, high = -1, count
    while high - low > 1:
        middle = (low + high) // 2
        if x < number_at(e.table, middle):
            high = middle
        else:
            low = middle
    return low if period == 0.0 else turn * (count - 1) + min(max(low, 0), count - 2)


@kernel
def interpolate(e, s, x):
    """Value at `x`, constant beyond the ends; the cell between two knots is a branch."""
    if s.choose:
        e.side[0] = cell_of(e, x.real)
    cell = e.side[0]
    low, high = knot(e, cell), knot(e, cell + 1)
    if x.real - low < high - x.real:
        e.gap[0], e.next[0] = x.real - low, cell - 1
    else:
        e.gap[0], e.next[0] = high - x.real, cell + 1
    return between_knots(e, cell, x)


@inlined
def between_knots(e, cell, x):
    """Value on the straight line of a cell, constant beyond the ends."""
    low, high = knot(e, cell), knot(e, cell + 1)
    left, right = value_at_knot(e, cell), value_at_knot(e, cell + 1)
    share = (x - low) / (high - low) if low > -inf and high < inf else 0.0 * x
    return left + share * (right - left)


@kernel
def act(e, s, out, value):
    """Let a value act where the table says."""
    action = int(e.q[ACTION].real)
    if action == TORQUE_U:
        out.torque_u += value
    elif action == TORQUE_L:
        out.torque_l += value
    elif action == STRING:
        out.string += value
    elif action == FRICTION_U:
        out.size_u += value
    elif action == FRICTION_L:
        out.scale_l += value
    elif action == ANGLE_U:
        out.angle_u += value
    elif action == ANGLE_L:
        out.angle_l += value
    elif action == DRIVE_U:
        out.volts += s.u * value
    elif action == DAMPING_U:
        out.torque_u -= value * s.omega_u
    elif action == DAMPING:
        out.string += value * (s.omega_u - s.omega_l)
    else:
        out.string += value * s.pull


@response
def tabulated(p, e, s, out):
    """Add the table's torque or error; `e.q` holds its coordinate, action, length and period."""
    act(e, s, out, interpolate(e, s, coordinate_of(int(e.q[COORDINATE].real), s)))


@response
def sampled(p, e, s, out):
    """As `tabulated`, of dense samples of something smooth, whose knots end no step."""
    x = coordinate_of(int(e.q[COORDINATE].real), s)
    act(e, s, out, between_knots(e, cell_of(e, x.real), x))
