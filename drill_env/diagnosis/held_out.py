"""How a fit does on recordings that it has not seen, before and after its terms."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drill_env._errors import InputError
from drill_env._threads import each
from drill_env._types import FloatArray, IntArray
from drill_env.diagnosis.applied import with_terms
from drill_env.diagnosis.declare import extended_rig
from drill_env.diagnosis.extended import lost_value, motion_of
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.joint import LAST_ROUNDS, WORTH_A_ROUND
from drill_env.diagnosis.start_twist import settled_with
from drill_env.effects.along import Motion, inner_states
from drill_env.effects.steady import acting as acting_rig
from drill_env.identification.known_loads import loaded
from drill_env.identification.noise import NoiseModel, usual_noise
from drill_env.identification.prediction_error import Path, path_of
from drill_env.identification.samples import Samples
from drill_env.identification.smoothing import smoothed
from drill_env.integrator.simulate import simulate
from drill_env.integrator.trajectory import Trajectory
from drill_env.integrator.voltage import Voltage
from drill_env.integrator.windows import resume
from drill_env.parameters import Rig
from drill_env.recordings import Channel

HORIZON = 5.0


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """One recording under one fit.

    Attributes:
        value: minus twice the log likelihood, without its constant.
        floor: what it would be in the mean if the fit were the truth.
        count: samples predicted.
        free: free-run angles, or velocities as `channels` says, shape (n, 2).
        short: the same predicted from the smoothed state at most 5 s before, shape (n, 2).
        measured: the same as measured, shape (n, 2).
        motion: what all samples say of the motion.
        torques: smoothed latent torques, Nm, shape (n, 2).
        spans: rows at which the predictions of 5 s begin, ascending, the first 0.
        channels: what each disc is judged by: its angle, or its velocity where that is all.
    """

    value: float
    floor: float
    count: int
    free: FloatArray
    short: FloatArray
    measured: FloatArray
    motion: Motion
    torques: FloatArray
    spans: IntArray
    channels: tuple[Channel, Channel] = ("theta_u", "theta_l")


def judged_channels(samples: Samples) -> tuple[Channel, Channel]:
    """What each disc is judged by: its angle, or its velocity where that is all."""
    there = [bool(np.isfinite(column).any()) for column in samples.angles.T]
    by_speed = [len(there) > 2 and there[2 + d] and not there[d] for d in range(2)]
    return ("omega_u" if by_speed[0] else "theta_u", "omega_l" if by_speed[1] else "theta_l")


def _measured(samples: Samples) -> FloatArray:
    places = [samples.names.index(name) for name in judged_channels(samples)]
    measured = samples.angles[:, places]
    if samples.recording.drive == "motion":
        # An input is not predicted.
        measured[:, 0] = math.nan
    return measured


def _latent(samples: Samples, states: FloatArray) -> FloatArray:
    """Smoothed latent torques, Nm, shape (n, 2); none on a disc whose motion is prescribed."""
    torques = states[:, 4:]
    return torques * [0.0, 1.0] if samples.recording.drive == "motion" else torques


def judge(samples: Samples, setting: Setting, fit: Fit) -> Judged:
    """Filter, free run and 5 s predictions of one recording under a fit, its starts settled."""
    motion, given, path = followed(samples, setting, fit)
    w = path.rows["weight"]
    used = w > 0
    smooth = smoothed(given, fit.noise, path)
    states = smooth.states
    rows, spans = samples.restarts, spans_of(samples)
    rig, offset = extended_rig(fit.rig, fit.terms), offset_of(given, states)
    free = _run_from(samples, rig, motion, offset, rows)
    short = _run_from(samples, rig, motion, offset, spans)
    count = int(used.sum())
    floor = float(np.sum(-2.0 * np.log(w[used])) + count)
    value, floor = (v + lost_value(samples, given, v, count) for v in (path.value, floor))
    return Judged(
        value, floor, count,
        free, short, _measured(samples), motion, _latent(samples, states), spans,
        judged_channels(samples),
    )  # fmt: skip


def remaining(setting: Setting, fit: Fit) -> list[tuple[Motion, FloatArray]]:
    """What all samples of each fitted recording say of its motion, and the latent torques (Nm)."""

    def one(job: tuple[Samples, FloatArray, Motion]) -> tuple[Motion, FloatArray]:
        samples, starts, motion = job
        given = with_terms(samples, fit.terms, fit.rig, motion)
        path = path_of(given, fit.rig, fit.noise, starts, setting.robust)
        latent = _latent(samples, smoothed(given, fit.noise, path).states)
        return motion_of(given, fit.noise, path), latent

    return each(one, zip(setting.samples, fit.starts, fit.motions, strict=True))


def judge_all(held: Sequence[Samples], setting: Setting, fit: Fit) -> tuple[Judged, ...]:
    """Each recording under a fit, see `judge`."""
    return tuple(each(lambda samples: judge(samples, setting, fit), held))


def followed(samples: Samples, setting: Setting, fit: Fit) -> tuple[Motion, Samples, Path]:
    """What all samples of a recording that was not fitted say of its motion under a fit."""
    # Without effects, under little noise, it would go its own way.
    noise = _larger(usual_noise(setting.coordinates.base), setting.wide or fit.noise)
    path = path_of(samples, fit.rig, noise, samples.starts, setting.robust)
    motion = motion_of(samples, noise, path)
    given, starts, value = samples, samples.starts, math.inf
    for _ in range(LAST_ROUNDS if fit.terms or fit.rig.effects else 1):
        starts, there, again = settled_with(
            samples, fit.terms, fit.rig, fit.noise, motion, starts, setting.robust
        )
        gain = value - again.value
        if gain <= 0.0:
            break
        given, path, value = there, again, again.value
        motion = motion_of(given, fit.noise, path)
        if not gain >= WORTH_A_ROUND:
            break
    return motion, given, path


def _larger(one: NoiseModel, other: NoiseModel) -> NoiseModel:
    """The other noise with the larger of both latent torques on each disc."""
    return replace(
        other, torque_u=max(one.torque_u, other.torque_u),
        torque_l=max(one.torque_l, other.torque_l),
    )  # fmt: skip


def spans_of(samples: Samples) -> IntArray:
    """Rows at which predictions of 5 s begin, ascending."""
    return np.unique(np.concatenate([samples.restarts, rows_each(samples, HORIZON)]))


def rows_each(samples: Samples, seconds: float) -> IntArray:
    """Rows that begin a span of so many seconds, ascending."""
    ends = [*samples.restarts[1:].tolist(), len(samples.t)]
    rows = []
    for a, b in zip(samples.restarts.tolist(), ends, strict=True):
        times = np.arange(float(samples.t[a]), float(samples.t[b - 1]), seconds)
        rows.append(a + np.searchsorted(samples.t[a:b], times - 1e-9))
    return np.concatenate(rows).astype(np.int64)


def _run_from(
    samples: Samples, rig: Rig, motion: Motion, offset: FloatArray, rows: IntArray
) -> FloatArray:
    """What is judged, simulated anew from each of some rows, shape (n, 2), as it is read."""
    channels = judged_channels(samples)
    rig = loaded(rig, samples.recording)
    out = np.full((len(samples.t), 2), math.nan)
    kept = inner_states(acting_rig(rig), motion, rows)
    ends = [*rows[1:].tolist(), len(samples.t)]
    for a, b, inner in zip(rows.tolist(), ends, kept, strict=True):
        stop = min(b + 1, len(samples.t)) if b not in samples.restarts else b
        if stop - a < 2:
            continue
        try:
            fresh = None if a in samples.restarts else inner
            ahead = resume(rig, motion, slice(a, stop), fresh)
            out[a:stop] = as_read(ahead.states, ahead.readings, channels)
        except (InputError, RuntimeError):
            return np.full_like(out, math.inf)
        if channels[0] == "theta_u":
            out[a:b, 0] -= offset[a]
    return out


def offset_of(samples: Samples, states: FloatArray) -> FloatArray:
    """Twist at which the encoders agree, from the smoothed twist and the measured angles."""
    difference = samples.angles[:, 0] - samples.angles[:, 1]
    ends = [*samples.restarts[1:].tolist(), len(samples.t)]
    out = np.zeros(len(samples.t))
    for a, b in zip(samples.restarts.tolist(), ends, strict=True):
        gap = states[a:b, 0] - difference[a:b]
        known = gap[np.isfinite(gap)]
        out[a:b] = float(np.median(known)) if len(known) else 0.0
    return out


def run_from_start(rig: Rig, t: FloatArray, u: FloatArray, start: FloatArray) -> Trajectory:
    """A run from the start of some rows, whose effects count time as the rows do."""
    return simulate(
        rig, Voltage(t, u[:-1, None]), float(t[-1] - t[0]), t_start=float(t[0]), t_eval=t,
        initial=start, method="dopri5", rtol=1e-7, atol=1e-9,
    )  # fmt: skip


def as_read(
    states: FloatArray, angles: FloatArray, channels: tuple[Channel, Channel]
) -> FloatArray:
    """Angles as they are read, or velocities where those are judged, shape (n, 2)."""
    columns = [
        angles[:, d] if name.startswith("theta") else states[:, 1 + d]
        for d, name in enumerate(channels)
    ]
    return np.column_stack(columns)


def rms(judged: Sequence[Judged], which: str, disc: int) -> float:
    """Root mean square error (rad, rad/s) of the free or short runs of several recordings."""
    parts = [getattr(j, which)[:, disc] - j.measured[:, disc] for j in judged]
    errors = np.concatenate(parts)
    errors = errors[~np.isnan(errors)]
    if len(errors) == 0:
        return math.nan
    with np.errstate(over="ignore"):
        return float(np.sqrt(np.mean(errors**2)))
