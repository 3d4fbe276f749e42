"""Compiled effects that act at the filtered state: they decide when a disc rests.

A torque is the mean over an interval of foreseen motion and is held over it.
"""

from math import ceil
from typing import NamedTuple

import numpy as np

from drill_env._jit import kernel
from drill_env._types import FloatArray, IntArray
from drill_env.dynamics.kernels import lower_rate, upper_rate
from drill_env.effects.along import call_over_interval
from drill_env.identification._filter_state import D_L, D_U
from drill_env.integrator.records import N_STATE

# Least step of a speed, rad/s; small against any motion, far above rounding.
_STEP = 1e-6
# Where a disc comes to rest or leaves it, torques are held for so many seconds at most.
_HOLD = 1e-3


class Acting(NamedTuple):
    """Effects with what they remember and what they say.

    Memories are inner states, then branches, then the time for which the lower disc has rested.
    """

    entries: np.ndarray
    discs: IntArray  # 1 where one of them acts on the upper, lower disc
    memories: FloatArray
    trial: FloatArray
    after: FloatArray
    signal: np.ndarray
    ports: np.ndarray
    motion: FloatArray  # begin, rates and rates of the interval's first part
    mean: FloatArray
    z: FloatArray
    over_interval: int  # address of `over_interval`, 0 where nothing acts
    only_at_rest: bool  # whether all of them act on a disc at rest alone


@kernel
def forget_acting(f, effects):
    """Begin anew."""
    for i in range(effects.memories.size):
        effects.memories[i] = 0.0
    f.acted[0] = f.acted[1] = 0.0
    f.fresh = 1


@kernel
def recall(source, goal):
    """Copy memories."""
    for i in range(source.size):
        goal[i] = source[i]


@kernel
def moving_share(effects, run, disc, rate, dt):
    """Share of the interval until a disc of the effects comes to rest; 1 without end."""
    omega = run.y[1 + disc]
    if effects.discs[disc] == 0 or run.mode[disc] == 0 or omega == 0.0:
        return 1.0
    if omega * rate >= 0.0 or abs(rate) * dt <= abs(omega):
        return 1.0
    return abs(omega) / (abs(rate) * dt)


@kernel
def ask_all(f, p, effects, t, dt, u, share):
    """Carry all effects over a straight part of the interval; their mean torques are added."""
    s, memory, inner = effects.signal[0], effects.trial, 0
    for i in range(effects.entries.size):
        inner += effects.entries[i].states
    dwell = memory[memory.size - 1]
    torque_u = torque_l = 0.0
    for i in range(effects.entries.size):
        e = effects.entries[i]
        for j in range(e.states):
            e.z[j] = memory[e.first_state + j]
        for j in range(e.switches):
            e.side[j] = int(memory[inner + e.first_switch + j])
        s.first, s.dwell_l = f.fresh, dwell
        s.other_u, s.other_l = torque_u, torque_l
        effects.mean[0] = effects.mean[1] = 0.0
        call_over_interval(
            effects.over_interval, p, e, s, effects.ports[0], effects.motion[0],
            effects.motion[1], t, dt, u, effects.z, effects.mean,
        )  # fmt: skip
        torque_u += effects.mean[0]
        torque_l += effects.mean[1]
        for j in range(e.states):
            memory[e.first_state + j] = e.z[j]
        for j in range(e.switches):
            memory[inner + e.first_switch + j] = e.side[j]
    rests = effects.motion[0, 2] == 0.0 and effects.motion[1, 2] == 0.0
    memory[memory.size - 1] = dwell + dt if rests else 0.0
    f.answer[0] += share * torque_u
    f.answer[1] += share * torque_l


@kernel
def answer(f, p, run, effects, t, dt, u):
    """Mean torques over `dt` s from the integrator's state go to `f.answer`."""
    y, mode, begin, rate = run.y, run.mode, effects.motion[0], effects.motion[1]
    recall(effects.memories, effects.trial)
    rate[0], rate[3] = y[1] - y[2], y[2]
    rate[1] = upper_rate(p, mode[0], y[0], y[1], u)
    rate[2] = lower_rate(p, mode[1], mode[2], y[0], y[2])
    f.rates[0], f.rates[1] = rate[1], rate[2]
    for i in range(N_STATE):
        begin[i] = y[i]
    f.answer[0] = f.answer[1] = 0.0
    fresh = f.fresh
    for disc in range(2):
        share = moving_share(effects, run, disc, rate[1 + disc], dt)
        if share < 1.0:
            # It slides until it rests: by steps, the torque would jump where a little more speed
            # carries it through.
            ask_all(f, p, effects, t, share * dt, u, share)
            f.fresh = 0
            for i in range(N_STATE):
                begin[i] += share * dt * rate[i]
            begin[1 + disc] = rate[1 + disc] = 0.0
            ask_all(f, p, effects, t + share * dt, (1.0 - share) * dt, u, 1.0 - share)
            f.fresh = fresh
            return
    ask_all(f, p, effects, t, dt, u, 1.0)


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
    answer(f, p, run, effects, t, dt, u)
    commit(f, p, effects, effects.trial, f.answer[0], f.answer[1])


@kernel
def look_ahead(f, p, run, effects, t, dt, u):
    """What the effects do over the coming interval of `dt` s, or its first part, and the slopes.

    A slope is the divided difference over the speed's own doubt (Norgaard, Poulsen and Ravn,
    Automatica 36, 2000): next to a jump of the torque the derivative says nothing of its course.
    """
    if effects.only_at_rest and slides_on(f, p, run, effects, dt, u):
        forget_acting(f, effects)
        commit(f, p, effects, effects.memories, 0.0, 0.0)
        return
    answer(f, p, run, effects, t, dt, u)
    recall(effects.trial, effects.after)
    f.parts = parts_of(f, run, effects, dt)
    torque_u, torque_l = f.answer[0], f.answer[1]
    for disc in range(2):
        kept = run.y[1 + disc]
        f.bend[0, disc] = f.bend[1, disc] = 0.0
        if effects.discs[disc] != 0 and kept != 0.0:
            step = max(max(f.P[1 + disc, 1 + disc], 0.0) ** 0.5, _STEP)
            if kept < 0.0 and kept + step >= 0.0:
                # Beyond rest it would turn the other way.
                step = -step
            run.y[1 + disc] = kept + step
            answer(f, p, run, effects, t, dt, u)
            f.bend[0, disc] = (f.answer[0] - torque_u) / step
            f.bend[1, disc] = (f.answer[1] - torque_l) / step
            run.y[1 + disc] = kept
    if f.parts == 1:
        commit(f, p, effects, effects.after, torque_u, torque_l)
    else:
        act(f, p, run, effects, t, dt / f.parts, u)


@kernel
def slides_on(f, p, run, effects, dt, u):
    """Whether no disc of the effects rests, or comes to rest, in an interval of `dt` s."""
    y, mode = run.y, run.mode
    f.rates[0] = upper_rate(p, mode[0], y[0], y[1], u)
    f.rates[1] = lower_rate(p, mode[1], mode[2], y[0], y[2])
    f.bend[:], f.parts = 0.0, parts_of(f, run, effects, dt)
    return f.parts == 1


@kernel
def parts_of(f, run, effects, dt):
    """Into how many parts an interval is cut: one, but where such a disc rests or is about to."""
    rests_u = run.mode[0] * (run.y[1] + f.rates[0] * dt) <= 0.0
    rests_l = run.mode[1] * (run.y[2] + f.rates[1] * dt) <= 0.0
    if (effects.discs[0] != 0 and rests_u) or (effects.discs[1] != 0 and rests_l):
        return int(ceil(dt / _HOLD - 1e-6))
    return 1


@kernel
def bend_transition(f):
    """The transition's share that the effects' torques have in it."""
    for i in range(N_STATE):
        for disc in range(2):
            f.F[i, 1 + disc] += f.F[i, D_U] * f.bend[0, disc] + f.F[i, D_L] * f.bend[1, disc]
