"""Simulation of a rig with effects."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray, IntArray
from drill_env.effects.declared import declared, longest_hold, new_memories
from drill_env.friction import kernel_record
from drill_env.integrator._advance import LOG_FULL, STEP_TOO_SMALL, TOO_MANY_STEPS
from drill_env.integrator._extended import Scratch, new_scratch, run_nodes
from drill_env.integrator._modes import start_mode
from drill_env.integrator._records import N_STATE, RUN
from drill_env.integrator._tableau import tableau
from drill_env.integrator.trajectory import Events, Trajectory
from drill_env.integrator.voltage import Voltage
from drill_env.parameters import Rig
from drill_env.parameters._record import N_PARAMETERS

SUBSTEP = 1e-3
"""Time (s) for which the effects' torques are held unless said otherwise."""

_RTOL, _ATOL = 1e-9, 1e-11
_NEAR, _LONGEST = 1e-9, 0.1


@dataclass(frozen=True, slots=True, eq=False)
class ExtendedRun:
    """What a rig with effects did from node to node.

    Attributes:
        state: (twist, omega_u, omega_l, theta_l) at the nodes, shape (n, 4).
        modes: slip direction of (upper, lower) disc there, shape (n, 2).
        errors: of the encoders there, rad, shape (n, 2).
        log: records of the events.
        run: record of the integrator at the end.
    """

    state: FloatArray
    modes: IntArray
    errors: FloatArray
    log: np.ndarray
    run: np.ndarray


def run_extended(
    rig: Rig,
    t: FloatArray,
    u: FloatArray,
    initial: FloatArray,
    *,
    substep: float = SUBSTEP,
    modes: IntArray | None = None,
    memories: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Simulate a rig with its effects through a sampled voltage.

    Between its events the rig is integrated exactly; the effects' torques are taken at the
    foreseen middle of each substep and held over it, which makes the motion second order in the
    substep. The effects count time as `t` does.

    Args:
        rig: parameters and effects; without effects the motion is that of `simulate`.
        t: times in s, ascending, shape (n,).
        u: voltages in V, u[i] held from t[i] to t[i + 1], shape (n,).
        initial: (twist, omega_u, omega_l, theta_l) at t[0], shape (4,).
        substep: longest time in s for which an effect's torque is held.
        modes: (upper, lower, clamped) to continue a run with, shape (3,).
        memories: what the effects remember at t[0], of `memories_along`; nothing by default.

    Returns:
        States, shape (n, 4), and what the encoders read, theta_u and theta_l in rad with the
        errors of the sensors' effects but without rounding, shape (n, 2).

    Raises:
        InputError: an argument or an effect of the rig is wrong.
        RuntimeError: the step size collapsed (NaN in the parameters, say).
    """
    t, u = np.ascontiguousarray(t, dtype=float), np.ascontiguousarray(u, dtype=float)
    if t.ndim != 1 or len(t) < 2 or u.shape != t.shape or not (np.diff(t) > 0).all():
        raise InputError(
            f"t has shape {t.shape} and u {u.shape}: give two or more ascending times and as "
            "many voltages"
        )
    if not np.isfinite(u).all():
        raise InputError("u holds NaN or infinity: remove those rows")
    counts = substep_counts(rig, t, substep)
    start = np.array(initial, dtype=float)
    if start.shape != (N_STATE,) or not np.isfinite(start).all():
        raise InputError("initial must be four finite numbers: twist, omega_u, omega_l, theta_l")
    done = run_through(rig, t, counts, np.repeat(u[:-1], counts), start, modes, memories)
    theta_l = done.state[:, 3]
    readings = np.column_stack([theta_l + done.state[:, 0], theta_l]) + done.errors
    return done.state, readings


def substep_counts(rig: Rig, nodes: FloatArray, substep: float = SUBSTEP) -> IntArray:
    """How many substeps each interval between `nodes` (s) is cut into.

    Raises:
        InputError: the substep is no positive number.
    """
    if not (math.isfinite(substep) and substep > 0):
        raise InputError(f"substep is {substep}: give seconds greater than 0")
    declared(rig)
    hold = min(substep, longest_hold(rig))
    # A sampled time is a little longer than its rounded interval.
    return np.maximum(np.ceil(np.diff(nodes) / hold - 1e-6), 1.0).astype(np.int64)


def run_through(
    rig: Rig,
    nodes: FloatArray,
    counts: IntArray,
    volts: FloatArray,
    initial: FloatArray,
    modes: IntArray | None = None,
    memories: FloatArray | None = None,
    *,
    rtol: float = _RTOL,
    atol: float = _ATOL,
) -> ExtendedRun:
    """Simulate a rig with its effects from node to node.

    Args:
        rig: parameters and effects.
        nodes: times in s, ascending, shape (n,).
        counts: substeps of each interval, shape (n - 1,).
        volts: voltages of all substeps one after another, V.
        initial: state at the first node, shape (4,).
        modes: (upper, lower, clamped) to continue with, shape (3,).
        memories: what the effects remember at the first node; nothing by default.
        rtol: relative tolerance of a step.
        atol: absolute tolerance of a step.

    Raises:
        InputError: an effect of the rig is wrong.
        RuntimeError: the step size collapsed.
    """
    bundle, p, n = declared(rig), kernel_record(rig), len(nodes)
    fresh, scratch = memories is None, new_scratch(rtol, atol)
    memories = new_memories(bundle) if memories is None else memories.copy()
    run = np.zeros(1, dtype=RUN)
    run["y"], run["t"], run["h"] = initial, nodes[0], 1e-3
    if modes is None:
        start_mode(p[0], run[0], float(volts[0]))
    else:
        run["mode"] = modes
    out, errors = np.zeros((n, N_STATE)), np.zeros((n, 2))
    disc_modes = np.zeros((n, 2), dtype=np.int64)
    logs, status, node = [], LOG_FULL, 0
    while status == LOG_FULL:
        run["logged"] = 0
        status, node = run_nodes(
            node, int(fresh), p[0], run[0], tableau("dopri5")[0], bundle, memories, scratch,
            nodes, counts, volts, out, disc_modes, errors,
        )  # fmt: skip
        logs.append(_taken(scratch, run))
    if status in (STEP_TOO_SMALL, TOO_MANY_STEPS) or not np.isfinite(run["y"]).all():
        raise RuntimeError(
            f"integration with effects stopped at t = {float(run['t'][0]):.6g} s, state "
            f"{run['y'][0].tolist()}"
        )
    return ExtendedRun(out, disc_modes, errors, np.concatenate(logs), run[0])


def run_voltage(
    rig: Rig,
    drive: Voltage,
    times: FloatArray,
    initial: FloatArray,
    modes: IntArray | None,
    *,
    rtol: float,
    atol: float,
) -> Trajectory:
    """Simulate a rig with its effects through any voltage, as `simulate` does without them."""
    nodes = _nodes(drive, times)
    counts = substep_counts(rig, nodes)
    begins, ends = _cut(nodes, counts)
    volts = drive(0.5 * (begins + ends))
    done = run_through(rig, nodes, counts, volts, initial, modes, rtol=rtol, atol=atol)
    rows = _nearest(nodes, times)
    end = done.run
    return Trajectory(
        times, done.state[rows], done.modes[rows], drive, Events.from_log(done.log),
        np.zeros((0, N_STATE, N_STATE + N_PARAMETERS)), end["y"].copy(), end["mode"].copy(),
        float(end["max_speed"]), int(end["steps"]), done.errors[rows],
    )  # fmt: skip


def _nodes(drive: Voltage, times: FloatArray) -> FloatArray:
    """Start, end, samples and breaks of the voltage, none nearer to another than rounding."""
    wanted = np.unique(np.concatenate([drive.breaks[:1], times, drive.breaks[-1:]]))
    breaks = drive.breaks[np.abs(drive.breaks - wanted[_nearest(wanted, drive.breaks)]) > _NEAR]
    nodes = np.unique(np.concatenate([wanted, breaks]))
    nodes = nodes[np.concatenate([[True], np.diff(nodes) > _NEAR])]
    # The log of events is emptied at nodes only.
    parts = np.ceil(np.diff(nodes) / _LONGEST).astype(np.int64)
    return np.append(_cut(nodes, parts)[0], nodes[-1])


def _cut(nodes: FloatArray, counts: IntArray) -> tuple[FloatArray, FloatArray]:
    """Begins and ends (s) of so many equal parts of each interval."""
    width = np.repeat(np.diff(nodes) / counts, counts)
    place = np.arange(len(width)) - np.repeat(np.cumsum(counts) - counts, counts)
    begins = np.repeat(nodes[:-1], counts) + place * width
    return begins, begins + width


def _nearest(nodes: FloatArray, times: FloatArray) -> IntArray:
    after = np.clip(np.searchsorted(nodes, times), 1, len(nodes) - 1)
    return np.where(times - nodes[after - 1] < nodes[after] - times, after - 1, after)


def _taken(scratch: Scratch, run: np.ndarray) -> np.ndarray:
    return scratch.log[: int(run["logged"][0])].copy()
