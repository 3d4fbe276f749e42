"""Compiled sum of all effects that a rig declares."""

from typing import NamedTuple

from drill_env._jit import kernel
from drill_env._types import FloatArray, IntArray
from drill_env.effects._run import forget, set_torques
from drill_env.effects._signal import respond
from drill_env.effects._table import tabulated

TABLE = 0


class Bundle(NamedTuple):
    """Declared effects; axis 0 counts them. Friction comes last, for it reads what else pulls."""

    codes: IntArray  # addresses for `respond`, of this process alone, or TABLE
    senses: IntArray  # 1 where the encoders are wrong and not the rig
    upper: IntArray  # 1 where it acts on the upper disc alone
    q: FloatArray
    tables: FloatArray  # knots and values


@kernel
def add_response(i, p, bundle, memories, s, out):
    """Add the response of effect `i`."""
    if bundle.codes[i] == TABLE:
        tabulated(p, bundle.q[i], bundle.tables[i], s, out)
    else:
        respond(bundle.codes[i], p, bundle.q[i], memories[i], s, out)


@kernel
def forget_all(memories):
    """Clear the memories of all effects."""
    for i in range(memories.shape[0]):
        forget(memories[i])


@kernel
def add_torques(p, bundle, memories, s, out):
    """Torques (Nm) of all effects at the signal; friction holds against all that came before."""
    set_torques(p, s)
    if p.clamp and s.friction_l < 0.0:
        s.friction_l = 0.0
    net_u, net_l = s.net_u, s.net_l
    out.torque_u = out.torque_l = 0.0
    for i in range(bundle.codes.size):
        if bundle.senses[i] == 0:
            add_response(i, p, bundle, memories, s, out)
            s.net_u, s.net_l = net_u + out.torque_u, net_l + out.torque_l


@kernel
def add_errors(p, bundle, memories, s, out):
    """Errors (rad) of both encoders at the signal."""
    out.angle_u = out.angle_l = 0.0
    for i in range(bundle.codes.size):
        if bundle.senses[i] != 0:
            add_response(i, p, bundle, memories, s, out)
