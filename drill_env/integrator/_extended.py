"""Compiled integration of a rig with effects: their torques are held over short substeps.

A torque taken at the foreseen middle of a substep and held makes the motion second order in
the substep; the rig itself is integrated exactly between its events, as always.
"""

from typing import NamedTuple

import numpy as np

from drill_env._jit import entry, inlined, kernel
from drill_env._types import FloatArray, IntArray
from drill_env.dynamics._kernels import lower_rate, upper_rate
from drill_env.effects._bundle import add_errors, add_torques
from drill_env.effects._signal import RESPONSE, SIGNAL
from drill_env.integrator._advance import DONE, LOG_FULL, advance
from drill_env.integrator._records import EVENT, N_STATE, new_work

# One substep may log this many events before the log counts as full.
LOG_ROOM = 32


class Scratch(NamedTuple):
    """Working arrays of one thread."""

    signal: np.ndarray
    response: np.ndarray
    work: np.ndarray
    log: np.ndarray
    breaks: FloatArray
    piece: FloatArray
    times: FloatArray
    out: FloatArray
    modes: IntArray
    sens: FloatArray


def new_scratch(rtol: float, atol: float, logged: int = 1024) -> Scratch:
    """Working arrays; `logged` events fit into the log."""
    return Scratch(
        np.zeros(1, dtype=SIGNAL), np.zeros(1, dtype=RESPONSE),
        new_work(rtol, atol, event_tol=min(1e-16, 0.1 * rtol)), np.zeros(logged, dtype=EVENT),
        np.zeros(2), np.zeros((1, 1)), np.zeros(0), np.zeros((0, N_STATE)),
        np.zeros((0, 2), dtype=np.int64), np.zeros((0, 1, 1)),
    )  # fmt: skip


@inlined
def middle_speed(mode, omega, rate, dt):
    """Speed at the middle of `dt` s, 0 where the disc comes to rest on the way.

    At rest friction holds instead of drives, so that a disc that should stick does.
    """
    return 0.0 if mode * (omega + rate * dt) <= 0.0 else omega + 0.5 * dt * rate


@kernel
def foresee(p, run, s, t, dt, u):
    """Signal at the middle of the substep of `dt` s from `t` under the voltage `u`."""
    y, mode = run.y, run.mode
    s.t, s.dt, s.u = t + 0.5 * dt, dt, u
    s.alpha_u = upper_rate(p, mode[0], y[0], y[1], u)
    s.alpha_l = lower_rate(p, mode[1], mode[2], y[0], y[2])
    s.omega_u = middle_speed(mode[0], y[1], s.alpha_u, dt)
    s.omega_l = middle_speed(mode[1], y[2], s.alpha_l, dt)
    way = 0.25 * dt * (y[2] + s.omega_l)
    s.theta_l = y[3] + way
    s.theta_u = y[0] + y[3] + 0.25 * dt * (y[1] + s.omega_u)
    s.twist = s.theta_u - s.theta_l


@kernel
def read_errors(p, run, bundle, memories, scratch, t, dt, u):
    """Errors of the encoders in the present state go to the response."""
    s, y, mode = scratch.signal[0], run.y, run.mode
    s.t, s.dt, s.u = t, dt, u
    s.twist, s.omega_u, s.omega_l, s.theta_l = y[0], y[1], y[2], y[3]
    s.theta_u = y[0] + y[3]
    s.alpha_u = upper_rate(p, mode[0], y[0], y[1], u)
    s.alpha_l = lower_rate(p, mode[1], mode[2], y[0], y[2])
    add_errors(p, bundle, memories, s, scratch.response[0])


@kernel
def run_substep(p, run, tab, bundle, memories, scratch, begin, end, shift, u):
    """Carry the rig from `begin` to `end` s; effects read times later by `shift` s.

    Returns:
        The status of `advance`; events beyond the log's room are dropped.
    """
    s, out = scratch.signal[0], scratch.response[0]
    foresee(p, run, s, begin + shift, end - begin, u)
    add_torques(p, bundle, memories, s, out)
    p.load_u, p.load_l = out.torque_u, out.torque_l
    s.first = 0
    scratch.breaks[0], scratch.breaks[1] = begin, end
    scratch.piece[0, 0] = u
    run.t, run.piece, run.sample = begin, 0, 0
    logged = min(run.logged, scratch.log.size - LOG_ROOM)
    run.logged = logged
    while True:
        status = advance(
            p, run, scratch.work[0], tab, scratch.breaks, scratch.piece, scratch.times,
            scratch.out, scratch.modes, scratch.log, scratch.sens,
        )  # fmt: skip
        if status != LOG_FULL:
            return status
        run.logged = logged


@entry
def run_nodes(first, fresh, p, run, tab, bundle, memories, scratch, nodes, counts, volts, out,
              modes, errors):  # fmt: skip
    """Integrate from node to node, each interval cut into equal substeps.

    Args:
        first: node to start from; 0 reads the encoders there too.
        fresh: 1 where the effects remember nothing before node 0.
        p: record of `PARAMETERS`.
        run: record of `RUN`.
        tab: record of `TABLEAU`.
        bundle: effects.
        memories: of the effects, shape (effects, MEMORY).
        scratch: working arrays.
        nodes: times in s, ascending, shape (n,).
        counts: substeps of each interval, shape (n - 1,).
        volts: voltages of all substeps one after another, V.
        out: filled with the states at the nodes, shape (n, 4).
        modes: filled with the modes of the discs there, shape (n, 2).
        errors: filled with the errors of the encoders there, rad, shape (n, 2).

    Returns:
        A status of `advance` and the node reached; `LOG_FULL` asks to empty the log and call
        again from there.
    """
    place = 0
    for k in range(first):
        place += counts[k]
    for k in range(first, nodes.size):
        if k > 0 and k > first:
            begin, width = nodes[k - 1], (nodes[k] - nodes[k - 1]) / counts[k - 1]
            for i in range(counts[k - 1]):
                end = nodes[k] if i + 1 == counts[k - 1] else nodes[k - 1] + (i + 1) * width
                status = run_substep(
                    p, run, tab, bundle, memories, scratch, begin, end, 0.0, volts[place]
                )
                if status != DONE:
                    return status, k
                begin, place = end, place + 1
        if k == 0 or k > first:
            u = volts[place - 1] if k > 0 else volts[0]
            dt = nodes[k] - nodes[k - 1] if k > 0 else 0.0
            if k == 0 and fresh == 0:
                dt = nodes[1] - nodes[0]
            start = fresh if k == 0 else 0
            scratch.signal[0].first = start
            read_errors(p, run, bundle, memories, scratch, nodes[k], dt, u)
            scratch.signal[0].first = start
            answer = scratch.response[0]
            errors[k, 0], errors[k, 1] = answer.angle_u, answer.angle_l
            for i in range(N_STATE):
                out[k, i] = run.y[i]
            modes[k, 0], modes[k, 1] = run.mode[0], run.mode[1]
            if run.logged + LOG_ROOM > scratch.log.size:
                return LOG_FULL, k
    return DONE, nodes.size - 1
