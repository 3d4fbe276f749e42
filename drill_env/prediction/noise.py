"""What the noise of the readings alone makes of predictions.

A model that is right errs by what its noise gives (the predictive check of Box, Journal of the
Royal Statistical Society A 143, 1980). Where nothing errs by more, what a candidate gains is a
better guess of the state from noisy readings, and no physics.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drill_env._types import FloatArray
from drill_env.identification.equation_error import with_integrals
from drill_env.identification.noise import shiver
from drill_env.identification.samples import Samples
from drill_env.prediction.cut import Cut
from drill_env.prediction.fit import Fit

ALIKE = 2.0
"""Mean squares of a draw and of an error that differ by less than this factor may be alike."""


def is_noise(pairs: Sequence[tuple[Fit, Sequence[Cut]]], seed: int = 0) -> bool:
    """Whether predictions err at no lead by more than noise of the readings gives.

    Args:
        pairs: fits, and recordings that each was not fitted to.
        seed: of the draw.
    """
    rng, every = np.random.default_rng(seed), [(fit, one) for fit, cuts in pairs for one in cuts]
    errors = [one.errors(fit.rig, float(fit.vector[-1])) for fit, one in every]
    try:
        drawn = [errors_by_readings(fit, one, rng) for fit, one in every]
    except RuntimeError:
        return False
    squares = [np.mean(np.concatenate(part) ** 2, axis=0) for part in (errors, drawn)]
    return bool(np.isfinite(squares[1]).all() and np.all(squares[0] <= ALIKE * squares[1]))


def errors_by_readings(fit: Fit, one: Cut, rng: np.random.Generator) -> FloatArray:
    """Errors, rad, that a draw of the upper reading's noise makes, shape (w, k, c).

    Args:
        fit: of the rig.
        one: the recording.
        rng: of the draw.
    """
    shift, noise = float(fit.vector[-1]), drawn_noise(one.samples, rng)
    around, rows = one.starts.around.rows, one.windows.rows
    read, told = one.starts.read.copy(), np.zeros(one.target.shape)
    read[..., 0] += noise[around]
    told[..., 0] = noise[rows]
    other = replace(one, starts=replace(one.starts, read=read))
    return other.predicted(fit.rig, shift) - one.predicted(fit.rig, shift) - told


def drawn_noise(samples: Samples, rng: np.random.Generator) -> FloatArray:
    """A draw of the noise (rad) of the upper disc's reading, shape (n,).

    Of an angle that is the integral of a speed the noise adds up.
    """
    recording, t = samples.recording, samples.t
    normal = rng.standard_normal(len(t))
    if _is_integral(samples) and recording.omega_u is not None:
        held = shiver(recording.omega_u) * normal
        steps = 0.5 * (held[1:] + held[:-1]) * np.diff(t)
        return np.append(0.0, np.cumsum(steps))
    rounding = recording.quanta.get("theta_u", 0.0) / math.sqrt(12.0)
    return max(shiver(samples.angles[:, 0]), rounding) * normal


def _is_integral(samples: Samples) -> bool:
    recording = samples.recording
    if recording.omega_u is None or recording.theta_u is None:
        return False
    again = with_integrals(replace(recording, theta_u=None)).theta_u
    return again is not None and np.array_equal(again, recording.theta_u, equal_nan=True)
