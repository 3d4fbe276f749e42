"""Maximum-likelihood noise of recordings under given parameters."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from drill_env._types import FloatArray
from drill_env.identification.noise import NoiseModel
from drill_env.identification.prediction_error import Samples, Trace, trace_of
from drill_env.parameters import Rig

_STEP = 1e-3
_LONGEST_STEP = 1.5
# A weak pull towards the present values, lest a vanishing torque walk off to minus infinity.
_RIDGE = 1.0

_FLOORS = np.log([1e-5, 1e-7, 1e-3, 1e-3, 1e-9, 1e-9])
_CEILINGS = np.log([10.0, 1.0, 20.0, 20.0, 1.0, 1.0])


def noise_step(recordings: Sequence[Samples], rig: Rig, noise: NoiseModel) -> NoiseModel:
    """One step of Fisher scoring on the six logarithms of a noise model that recordings share.

    Args:
        recordings: from `prepare`.
        rig: parameters, held.
        noise: present model.
    """
    logs = noise.vector()
    tried = [logs, *(logs + _STEP * unit for unit in np.eye(len(logs)))]
    jobs = [(samples, NoiseModel.from_vector(v)) for samples in recordings for v in tried]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        traces = list(pool.map(lambda job: trace_of(job[0], rig, job[1]), jobs))
    gradient, information = np.zeros(len(logs)), np.eye(len(logs)) * _RIDGE
    for start in range(0, len(traces), len(tried)):
        part = _scoring(traces[start], traces[start + 1 : start + len(tried)])
        gradient, information = gradient + part[0], information + part[1]
    step = np.linalg.solve(information, -gradient)
    step *= min(1.0, _LONGEST_STEP / max(float(np.abs(step).max()), 1e-12))
    return NoiseModel.from_vector(np.clip(logs + step, _FLOORS, _CEILINGS))


def _scoring(base: Trace, moved: Sequence[Trace]) -> tuple[FloatArray, FloatArray]:
    used = base.variance > 0
    e, v = base.innovation[used], base.variance[used]
    slopes_v = np.array([np.log(m.variance[used] / v) / _STEP for m in moved])
    slopes_e = np.array([(m.innovation[used] - e) / _STEP for m in moved])
    gradient = slopes_v @ (0.5 * (1.0 - e * e / v)) + slopes_e @ (e / v)
    information = 0.5 * slopes_v @ slopes_v.T + (slopes_e / v) @ slopes_e.T
    return gradient, information
