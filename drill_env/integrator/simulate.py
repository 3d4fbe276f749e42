"""Exact simulation of one rig through any voltage."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray, IntArray, Method, VoltageFunction
from drill_env.effects.declared import REACH
from drill_env.effects.readings import errors_of
from drill_env.friction import negative_range
from drill_env.integrator._step import LOG_FULL, STEP_TOO_SMALL, TOO_MANY_STEPS
from drill_env.integrator.advance import advance
from drill_env.integrator.prepared import Prepared
from drill_env.integrator.records import (
    EVENT,
    LOAD_L,
    LOAD_U,
    N_COLUMNS,
    N_STATE,
    RUN,
    STEPS_PER_PERIOD,
    new_work,
)
from drill_env.integrator.slopes import numbers
from drill_env.integrator.tableau import METHODS
from drill_env.integrator.trajectory import Events, Trajectory
from drill_env.integrator.voltage import Voltage, as_voltage
from drill_env.parameters import Rig

REST: FloatArray = np.zeros(N_STATE)
"""Both discs at rest, string untwisted."""


# One warning a process: a sweep over the range would otherwise repeat it endlessly.
_warned: list[bool] = []


class NegativeFrictionWarning(UserWarning):
    """The lower disc entered speeds where its friction law is negative."""


def simulate(
    rig: Rig,
    voltage: float | VoltageFunction | Voltage,
    seconds: float,
    *,
    t_start: float = 0.0,
    t_eval: FloatArray | None = None,
    rate: float | None = None,
    initial: FloatArray | None = None,
    modes: IntArray | None = None,
    inner: FloatArray | None = None,
    method: Method = "dop853",
    rtol: float = 1e-10,
    atol: float = 1e-12,
    extrema: bool = False,
    sensitivity: bool = False,
) -> Trajectory:
    """Integrate the set-valued rig, with every stick, slip and reversal located.

    Effects of the rig are part of its equations of motion: their corners and jumps are located
    as sticks and slips are, and time counts for them as `t` does.

    Args:
        rig: parameters.
        voltage: constant (V), function of time, or `Voltage`, whose past before `t_start` an effect
            may read.
        seconds: duration in s.
        t_start: time of the initial state in s.
        t_eval: sample times in s, ascending, within the run.
        rate: samples per second instead of `t_eval`; 200 Hz if neither is given.
        initial: (twist, omega_u, omega_l, theta_l), rest by default, shape (4,).
        modes: (upper, lower, clamped) to continue a run with, shape (3,).
        inner: inner states of the effects to continue a run with, see `Trajectory.inner`.
        method: "dop853" (order 8) or "dopri5" (order 5).
        rtol: relative tolerance of a step.
        atol: absolute tolerance of a step.
        extrema: also log the turning points of omega_l.
        sensitivity: also return d state / d (initial state, parameters, effects' numbers); not
            with a delay of the voltage.

    Returns:
        The trajectory, its first sample at `t_start` if no `t_eval` is given.

    Raises:
        InputError: an argument is out of range or an effect of the rig is wrong.
        RuntimeError: the step size collapsed (NaN in the parameters, say).
    """
    _check(rig, seconds, rtol, atol, method)
    t_end = t_start + seconds
    times = _sample_times(t_start, t_end, t_eval, rate)
    drive = as_voltage(voltage, t_start, t_end)
    start = _initial_state(initial)
    prepared = Prepared(rig, method, sensitivity)
    run = np.zeros(1, dtype=RUN)
    run["y"], run["t"], run["h"] = start, t_start, min(1e-3, seconds)
    work = new_work(rtol, atol, _longest_step(rig), extrema=extrema, sensitivity=sensitivity)
    prepared.equip(work)
    prepared.start(run, work, float(drive(t_start)), modes, inner)
    # A stuck disc shrugs a small push off.
    for which in range(2):
        if run["mode"][0, which] == 0:
            work["sens"][0, 1 + which] = 0.0
    delays, asked = prepared.effects.encoder_delays, times
    if delays.any():
        asked = np.unique(np.concatenate([times, *(times - d for d in delays[delays > 0.0])]))
        asked = asked[asked >= t_start]
    earlier = voltage if isinstance(voltage, Voltage) else None
    pieces = prepared.drive(drive, work, start, earlier)
    found = _integrate(prepared, run, work, drive, pieces, asked, rig)
    return found if not prepared.effects.entries["senses"].any() else _read(prepared, found, times)


def _read(prepared: Prepared, found: Trajectory, times: FloatArray) -> Trajectory:
    """The run at the samples asked for, with the errors of its encoders there."""
    rows = np.searchsorted(found.t, times)
    delays = prepared.effects.encoder_delays
    earlier = np.searchsorted(found.t, times[:, None] - delays)
    late = np.stack([found.theta_u[earlier], found.theta_l[earlier]], axis=2)
    states, inner = found.state[rows], found.inner[rows]
    errors = errors_of(prepared.p, prepared.effects.entries, times, states, inner, late)
    slopes = found.sensitivity[rows] if len(found.sensitivity) else found.sensitivity
    return replace(
        found, t=times, state=states, modes=found.modes[rows], inner=inner, errors=errors,
        sensitivity=slopes,
    )  # fmt: skip


def _integrate(
    prepared: Prepared, run: np.ndarray, work: np.ndarray, voltage: Voltage, drive: Voltage,
    times: FloatArray, rig: Rig,
) -> Trajectory:  # fmt: skip
    p, pair, count = prepared.p, prepared.pair, len(times)
    first = int(np.searchsorted(times, run["t"][0], side="right"))
    out = np.zeros((count, N_STATE))
    modes = np.zeros((count, 2), dtype=np.int64)
    slopes = prepared.slopes
    width = N_COLUMNS if slopes is None else int(work["width"][0])
    sens = np.zeros((count if work["sensitivity"][0] else 0, N_STATE, width))
    inner = np.zeros((count, int(work["inner"][0])))
    out[:first], modes[:first] = run["y"][0], run["mode"][0, :2]
    first_sens = work["sens"][0] if slopes is None else slopes.record["sens"][0]
    sens[:first] = first_sens[:N_STATE, :width]
    inner[:first] = run["z"][0, : inner.shape[1]]
    logs, status = [], LOG_FULL
    while status == LOG_FULL:
        log = np.zeros(1024 << min(len(logs), 10), dtype=EVENT)
        run["logged"] = 0
        work["inner_out"] = inner[first:].ctypes.data if inner.size else 0
        status = advance(
            p[0], run[0], work[0], pair[0], drive.breaks, drive.pieces, times[first:],
            out[first:], modes[first:], log, sens[first:],
        )  # fmt: skip
        logs.append(log[: int(run["logged"][0])])
    # The columns of the external torques are the identification's.
    kept = sens
    if slopes is None and not work["sensitivity"][0]:
        kept = np.zeros((0, N_STATE, N_COLUMNS - 2 + len(numbers(rig))))
    elif slopes is None:
        # Numbers of effects that only the encoders show move nothing.
        idle = np.zeros((*sens.shape[:2], len(numbers(rig))))
        kept = np.concatenate([np.delete(sens, [LOAD_U, LOAD_L], axis=2), idle], axis=2)
    end = run[0]
    _check_status(status, end["t"], end["y"])
    _warn_if_negative(rig, end["max_speed"])
    return Trajectory(
        times, out, modes, voltage, Events.from_log(np.concatenate(logs)), kept, end["y"].copy(),
        end["mode"].copy(), float(end["max_speed"]), int(end["steps"]), inner,
        end["z"][: inner.shape[1]].copy(),
        final_sensitivity=np.zeros((0, 0)) if slopes is None else slopes.matrix(inner.shape[1]),
    )  # fmt: skip


def _check(rig: Rig, seconds: float, rtol: float, atol: float, method: str) -> None:
    if not (math.isfinite(seconds) and seconds > 0):
        raise InputError(f"seconds is {seconds}: give a duration greater than 0")
    if not (1e-15 < rtol < 1 and atol > 0):
        raise InputError(f"rtol={rtol}, atol={atol}: give 1e-15 < rtol < 1 and atol > 0")
    if method not in METHODS:
        raise InputError(f"method is {method!r}: give one of {', '.join(METHODS)}")


def _longest_step(rig: Rig) -> float:
    """Contacts must not hide between steps, nor samples inside a step err more than its end."""
    short = rig.natural_period / STEPS_PER_PERIOD
    return min(short, REACH / rig.viscous_rate) if rig.viscous_rate > 0.0 else short


def _sample_times(
    t_start: float, t_end: float, t_eval: FloatArray | None, rate: float | None
) -> FloatArray:
    if t_eval is None:
        rate = 200.0 if rate is None else rate
        if not (math.isfinite(rate) and rate > 0):
            raise InputError(f"rate is {rate}: give samples per second, greater than 0")
        count = math.floor((t_end - t_start) * rate * (1 + 1e-12) + 1e-9)
        return np.minimum(t_start + np.arange(count + 1) / rate, t_end)
    times = np.ascontiguousarray(t_eval, dtype=float)
    if times.ndim != 1 or not np.isfinite(times).all() or (np.diff(times) < 0).any():
        raise InputError("t_eval must be a one-dimensional ascending array of finite times")
    if len(times) and (times[0] < t_start or times[-1] > t_end):
        raise InputError(f"t_eval must lie within {t_start:g} to {t_end:g} s")
    return times


def _initial_state(initial: FloatArray | None) -> FloatArray:
    y = REST.copy() if initial is None else np.array(initial, dtype=float)
    if y.shape != (N_STATE,) or not np.isfinite(y).all():
        raise InputError("initial must be four finite numbers: twist, omega_u, omega_l, theta_l")
    return y


def _check_status(status: int, t: float, y: FloatArray) -> None:
    if status in (STEP_TOO_SMALL, TOO_MANY_STEPS):
        reason = "the step size collapsed" if status == STEP_TOO_SMALL else "too many steps"
        raise RuntimeError(f"integration stopped at t = {t:.6g} s ({reason}), state {y.tolist()}")


def _warn_if_negative(rig: Rig, max_speed: float) -> None:
    if rig.clamp or rig.inertias == 1 or _warned:
        return
    span = negative_range(rig)
    if span is not None and max_speed > span[0]:
        _warned.append(True)
        warnings.warn(
            f"the lower disc reached {max_speed:.1f} rad/s, where the friction torque of this rig "
            f"is negative ({span[0]:.1f} to {span[1]:.1f} rad/s, against equation (3)); "
            "use clamp=True to forbid it",
            NegativeFrictionWarning,
            stacklevel=3,
        )
