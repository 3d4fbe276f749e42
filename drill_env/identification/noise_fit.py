"""Maximum-likelihood noise of recordings under given parameters."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from drill_env._threads import each
from drill_env._types import FloatArray, IntArray
from drill_env.identification._noise_slopes import N_NOISE, NOISE_SLOPES, noise_slopes
from drill_env.identification.coordinates import solved
from drill_env.identification.noise import NoiseModel, usual_noise
from drill_env.identification.prediction_error import Trace, flat, path_of, reading_variances
from drill_env.identification.samples import Samples
from drill_env.parameters import Rig

_LONGEST_STEP = 2.0
# Standard deviations of the prior on the logarithms: correlation times far from a tenth of a
# second are hardly told from white or constant torques.
_PRECISION = 1.0 / np.array([10.0, 10.0, 0.5, 0.5, *[10.0] * 4]) ** 2
# Torques in usual ones of a rig of its size, see `usual_noise`; the rest in SI units.
_FLOORS = np.log([5e-5, 5e-5, 1e-3, 1e-3, 1e-9, 1e-9, 1e-6, 1e-6])
_CEILINGS = np.log([5e2, 5e3, 20.0, 20.0, 1.0, 1.0, 100.0, 100.0])
_SENSORS = 4


def noise_step(
    recordings: Sequence[Samples],
    starts: Sequence[FloatArray],
    rig: Rig,
    noise: NoiseModel,
    *,
    torques: bool = True,
    robust: float = math.inf,
    only: Sequence[int] | None = None,
    known: Sequence[Trace] | None = None,
) -> NoiseModel:
    """One step of Fisher scoring on the logarithms of a noise model that recordings share.

    Args:
        recordings: from `prepare`.
        starts: of each recording, held.
        rig: parameters, held.
        noise: present model.
        torques: whether the torques' size and correlation change, or the sensors' only.
        robust: standard deviations at which an innovation's weight ends.
        only: places of the values that move, in the order of `NoiseModel`; all by default.
        known: traces of `path_of` at the present model, where they are at hand.
    """
    logs = noise.vector()
    free = told(recordings, torques=torques)
    if only is not None:
        free = np.array(only)
    jobs = list(zip(recordings, starts, known or [None] * len(recordings), strict=True))

    def one(job: tuple[Samples, FloatArray, Trace | None]) -> tuple[FloatArray, FloatArray]:
        samples, start, trace = job
        trace = trace or path_of(samples, rig, noise, start, robust).trace
        return derivatives_by_noise(samples, noise, trace, robust)

    parts = each(one, jobs)
    prior = usual_noise(rig).vector()
    size = np.where(np.arange(len(prior)) < 2, prior, 0.0)
    gradient = (_PRECISION * (logs - prior) + np.sum([g for g, _ in parts], axis=0))[free]
    information = np.diag(_PRECISION) + np.sum([i for _, i in parts], axis=0)
    step = solved(information[np.ix_(free, free)], -gradient)
    step *= min(1.0, _LONGEST_STEP / max(float(np.abs(step).max()), 1e-12))
    logs[free] += step
    return NoiseModel.from_vector(np.clip(logs, _FLOORS + size, _CEILINGS + size))


def torques_told(noise: NoiseModel, rig: Rig) -> FloatArray:
    """1 for each disc whose torque is above the floor of its size, else 0; shape (2,).

    At the floor, as in a simulation without noise, a smoothed torque is rounding.
    """
    floors = _FLOORS[:2] + usual_noise(rig).vector()[:2]
    return (noise.vector()[:2] > floors + math.log(2.0)).astype(np.float64)


def told(recordings: Sequence[Samples], *, torques: bool = True) -> IntArray:
    """Places, in the order of `NoiseModel`, of the values that recordings can tell."""
    with_velocities = [s for s in recordings if s.angles.shape[1] > 2]
    sensors = np.array([_SENSORS, _SENSORS + 1])
    if with_velocities:
        read = np.any([np.isfinite(s.angles).any(axis=0) for s in with_velocities], axis=0)
        read[:2] |= len(with_velocities) < len(recordings)
        sensors = _SENSORS + np.flatnonzero(read)
    return np.concatenate([np.arange(_SENSORS) if torques else sensors[:0], sensors])


def derivatives_by_noise(
    samples: Samples, noise: NoiseModel, trace: Trace, robust: float
) -> tuple[FloatArray, FloatArray]:
    """Gradient and expected curvature of half of the value by a noise model's logarithms."""
    w = np.zeros(1, dtype=NOISE_SLOPES)
    w["variance"] = (noise.torque_u**2, noise.torque_l**2)
    w["rate"] = (1.0 / noise.tau_u, 1.0 / noise.tau_l)
    w["robust"], w["release"], w["relative"] = robust, samples.release, samples.relative
    by_size, by_gap = (np.zeros((*trace.innovation.shape, N_NOISE)) for _ in range(2))
    noise_slopes(
        w[0], samples.t, samples.restarts, trace.transitions, trace.stuck, trace.state,
        trace.innovation, trace.variance, reading_variances(samples, noise), by_size, by_gap,
    )  # fmt: skip
    used = trace.variance > 0
    by_size, by_gap = flat(by_size, used), flat(by_gap, used)
    v, e = flat(trace.variance, used), flat(trace.innovation, used)
    e = np.clip(e, -robust * np.sqrt(v), robust * np.sqrt(v))
    gradient = by_size.T @ (0.5 * (1.0 - e * e / v)) + by_gap.T @ (e / v)
    information = 0.5 * by_size.T @ by_size + by_gap.T @ (by_gap / v[:, np.newaxis])
    return gradient, information
