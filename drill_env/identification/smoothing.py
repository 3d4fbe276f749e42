"""Smoothed states and latent torques of a recording, and the slopes of any known disturbance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drill_env._types import FloatArray
from drill_env.identification._carry import carry, smooth
from drill_env.identification._filter_state import N_FILTER
from drill_env.identification.noise import NoiseModel
from drill_env.identification.prediction_error import Path
from drill_env.identification.samples import Samples


@dataclass(frozen=True, slots=True, eq=False)
class Smoothed:
    """What all samples together say of each row.

    Attributes:
        states: twist, omega_u, omega_l, theta_l, d_u, d_l; shape (n, 6).
        pull: slope of the log likelihood by a torque on each disc held over the interval after
            each row, 1/Nm, shape (n, 2).
        misread: slope of the log likelihood by an error of each reading, 1/rad or s/rad, shape
            (n, readings).
    """

    states: FloatArray
    pull: FloatArray
    misread: FloatArray


def smoothed(samples: Samples, noise: NoiseModel, path: Path) -> Smoothed:
    """Smooth a pass of the filter.

    Args:
        samples: the recording.
        noise: under which the pass was made.
        path: the pass.
    """
    n = len(samples.t)
    readings = samples.angles.shape[1]
    states, pull, misread = (np.zeros((n, m)) for m in (N_FILTER, 2, readings))
    rate = np.array([1.0 / noise.tau_u, 1.0 / noise.tau_l])
    smooth(
        path.rows, samples.t, rate, samples.restarts, samples.relative, path.trace.state,
        np.zeros(N_FILTER), np.zeros(N_FILTER), states, pull, misread,
    )  # fmt: skip
    return Smoothed(states, pull, misread)


def slopes_of(
    samples: Samples, noise: NoiseModel, path: Path, loads: FloatArray, errors: FloatArray | None
) -> FloatArray:
    """How known torques and sensor errors move the standardised predictions.

    Args:
        samples: the recording.
        noise: under which the pass was made.
        path: the pass.
        loads: torques on both discs over the interval after each row, Nm, shape (n, 2, m).
        errors: errors of both sensors' angles, rad, shape (n, 2, m), or None.

    Returns:
        Slopes, shape (n, readings, m), in the order of `path.rows["white"]`.
    """
    readings, count = samples.angles.shape[1], loads.shape[2]
    out = np.zeros((len(samples.t), readings, count))
    wrong = np.zeros((0, readings, count)) if errors is None else samples.misread(errors)
    state = np.zeros((N_FILTER, loads.shape[2]))
    rate = np.array([1.0 / noise.tau_u, 1.0 / noise.tau_l])
    carry(
        path.rows, samples.t, rate, samples.restarts, samples.relative,
        np.ascontiguousarray(loads), np.ascontiguousarray(wrong), state, out,
    )  # fmt: skip
    return out
