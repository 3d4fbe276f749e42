"""Compiled effects that act at the filtered state: they decide when a disc rests.

As in a simulation, a torque is taken at the foreseen middle of an interval and held over it.
"""

from math import ceil
from typing import NamedTuple

import numpy as np

from drill_env._jit import kernel
from drill_env._types import FloatArray, IntArray
from drill_env.effects._bundle import Bundle, add_torques
from drill_env.identification._filter_state import D_L, D_U
from drill_env.integrator._extended import foresee
from drill_env.integrator._records import N_STATE

# rad/s; small against any motion, far above rounding.
_STEP = 1e-6
# Where a disc comes to rest or leaves it, torques are held for so many seconds at most.
_HOLD = 1e-3

REMEMBERED = 8
"""Most numbers that such an effect remembers."""


class Acting(NamedTuple):
    """Effects with what they remember and what they say."""

    bundle: Bundle
    discs: IntArray  # 1 where one of them acts on the upper, lower disc
    memories: FloatArray
    trial: FloatArray
    after: FloatArray
    signal: np.ndarray
    response: np.ndarray


@kernel
def forget_acting(f, effects):
    """Begin anew."""
    for i in range(effects.memories.shape[0]):
        for j in range(effects.memories.shape[1]):
            effects.memories[i, j] = 0.0
    f.acted[0] = f.acted[1] = 0.0
    f.fresh = 1


@kernel
def recall(source, goal):
    """Copy memories."""
    for i in range(source.shape[0]):
        for j in range(source.shape[1]):
            goal[i, j] = source[i, j]


@kernel
def moving_share(effects, run, s, disc):
    """Share of the foreseen interval until a disc of the effects comes to rest; 1 without end."""
    omega = run.y[1 + disc]
    rate = s.alpha_u if disc == 0 else s.alpha_l
    if effects.discs[disc] == 0 or run.mode[disc] == 0 or omega == 0.0:
        return 1.0
    if omega * rate >= 0.0 or abs(rate) * s.dt <= abs(omega):
        return 1.0
    return abs(omega) / (abs(rate) * s.dt)


@kernel
def slide(s, disc, speed, dt):
    """Let the signal's disc turn at a speed for some time."""
    s.dt = dt
    if disc == 0:
        s.omega_u = speed
    else:
        s.omega_l = speed


@kernel
def answer(f, p, run, effects, t, dt, u):
    """Mean torques over `dt` s from the integrator's state go to the response."""
    s, out = effects.signal[0], effects.response[0]
    recall(effects.memories, effects.trial)
    s.first = f.fresh
    foresee(p, run, s, t, dt, u)
    for disc in range(2):
        share = moving_share(effects, run, s, disc)
        if share < 1.0:
            # It slides until it rests: by steps, the torque would jump where a little more speed
            # carries it through.
            speed = 0.5 * run.y[1 + disc]
            slide(s, disc, speed, share * dt)
            add_torques(p, effects.bundle, effects.trial, s, out)
            torque_u, torque_l = out.torque_u, out.torque_l
            s.first = 0
            slide(s, disc, 0.0, (1.0 - share) * dt)
            add_torques(p, effects.bundle, effects.trial, s, out)
            out.torque_u = share * torque_u + (1.0 - share) * out.torque_u
            out.torque_l = share * torque_l + (1.0 - share) * out.torque_l
            return
    add_torques(p, effects.bundle, effects.trial, s, out)


@kernel
def commit(f, p, effects, memories, torque_u, torque_l):
    """The effects go on with these memories and act with these torques."""
    recall(memories, effects.memories)
    f.fresh = 0
    f.acted[0], f.acted[1] = torque_u, torque_l
    p.load_u = f.load[0] + f.y[D_U] + torque_u
    p.load_l = f.load[1] + f.y[D_L] + torque_l


@kernel
def act(f, p, run, effects, t, dt, u):
    """What the effects do over `dt` s from the integrator's state."""
    out = effects.response[0]
    answer(f, p, run, effects, t, dt, u)
    commit(f, p, effects, effects.trial, out.torque_u, out.torque_l)


@kernel
def look_ahead(f, p, run, effects, t, dt, u):
    """What the effects do over the coming interval of `dt` s, or its first part, and the slopes."""
    out = effects.response[0]
    answer(f, p, run, effects, t, dt, u)
    recall(effects.trial, effects.after)
    f.parts = parts_of(run, effects, dt)
    torque_u, torque_l = out.torque_u, out.torque_l
    for disc in range(2):
        kept = run.y[1 + disc]
        f.bend[0, disc] = f.bend[1, disc] = 0.0
        if effects.discs[disc] != 0 and kept != 0.0:
            run.y[1 + disc] = kept + _STEP
            answer(f, p, run, effects, t, dt, u)
            f.bend[0, disc] = (out.torque_u - torque_u) / _STEP
            f.bend[1, disc] = (out.torque_l - torque_l) / _STEP
            run.y[1 + disc] = kept
    if f.parts == 1:
        commit(f, p, effects, effects.after, torque_u, torque_l)
    else:
        act(f, p, run, effects, t, dt / f.parts, u)


@kernel
def parts_of(run, effects, dt):
    """Into how many parts an interval is cut: one, but where such a disc rests or is about to."""
    s = effects.signal[0]
    rests_u = run.mode[0] == 0 or s.omega_u == 0.0
    rests_l = run.mode[1] == 0 or s.omega_l == 0.0
    if (effects.discs[0] != 0 and rests_u) or (effects.discs[1] != 0 and rests_l):
        return int(ceil(dt / _HOLD - 1e-6))
    return 1


@kernel
def bend_transition(f):
    """The transition's share that the effects' torques have in it."""
    for i in range(N_STATE):
        for disc in range(2):
            f.F[i, 1 + disc] += f.F[i, D_U] * f.bend[0, disc] + f.F[i, D_L] * f.bend[1, disc]
