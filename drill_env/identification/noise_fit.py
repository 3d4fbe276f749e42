"""Maximum-likelihood noise of recordings under given parameters."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from drill_env._types import FloatArray, IntArray
from drill_env.identification.noise import NoiseModel
from drill_env.identification.prediction_error import Trace, trace_of
from drill_env.identification.samples import Samples
from drill_env.parameters import Rig

_STEP = 1e-3
_LONGEST_STEP = 2.0
# Standard deviations of the prior on the logarithms: correlation times far from a tenth of a
# second are hardly told from white or constant torques.
_PRIOR = NoiseModel().vector()
_PRECISION = 1.0 / np.array([10.0, 10.0, 0.5, 0.5, *[10.0] * 4]) ** 2
_FLOORS = np.log([1e-6, 1e-8, 1e-3, 1e-3, 1e-9, 1e-9, 1e-6, 1e-6])
_CEILINGS = np.log([10.0, 1.0, 20.0, 20.0, 1.0, 1.0, 100.0, 100.0])
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
        known: traces at the present model, where they are at hand.
    """
    logs = noise.vector()
    free = told(recordings, torques=torques)
    if only is not None:
        free = np.array(only)
    tried = [logs + _STEP * unit for unit in np.eye(len(logs))[free]]
    if known is None:
        tried.insert(0, logs)
    jobs = [
        (samples, rig, NoiseModel.from_vector(logs), start, robust)
        for samples, start in zip(recordings, starts, strict=True)
        for logs in tried
    ]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        traces = list(pool.map(lambda job: trace_of(*job), jobs))
    gradient = (_PRECISION * (logs - _PRIOR))[free]
    information = np.diag(_PRECISION[free])
    for i in range(len(recordings)):
        own = traces[i * len(tried) : (i + 1) * len(tried)]
        base, moved = (own[0], own[1:]) if known is None else (known[i], own)
        part = _scoring(base, moved, robust)
        gradient, information = gradient + part[0], information + part[1]
    step = np.linalg.solve(information, -gradient)
    step *= min(1.0, _LONGEST_STEP / max(float(np.abs(step).max()), 1e-12))
    logs[free] += step
    return NoiseModel.from_vector(np.clip(logs, _FLOORS, _CEILINGS))


def told(recordings: Sequence[Samples], *, torques: bool = True) -> IntArray:
    """Places, in the order of `NoiseModel`, of the values that recordings can tell."""
    with_velocities = [s for s in recordings if s.angles.shape[1] > 2]
    sensors = np.array([_SENSORS, _SENSORS + 1])
    if with_velocities:
        read = np.any([np.isfinite(s.angles).any(axis=0) for s in with_velocities], axis=0)
        read[:2] |= len(with_velocities) < len(recordings)
        sensors = _SENSORS + np.flatnonzero(read)
    return np.concatenate([np.arange(_SENSORS) if torques else sensors[:0], sensors])


def _scoring(base: Trace, moved: Sequence[Trace], robust: float) -> tuple[FloatArray, FloatArray]:
    used = base.variance > 0
    v = base.variance[used]
    e = np.clip(base.innovation[used], -robust * np.sqrt(v), robust * np.sqrt(v))
    slopes_v = np.array([np.log(m.variance[used] / v) / _STEP for m in moved])
    slopes_e = np.array([(m.innovation - base.innovation)[used] / _STEP for m in moved])
    gradient = slopes_v @ (0.5 * (1.0 - e * e / v)) + slopes_e @ (e / v)
    information = 0.5 * slopes_v @ slopes_v.T + (slopes_e / v) @ slopes_e.T
    return gradient, information
