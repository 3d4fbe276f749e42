"""Where scores are taken: a fit, its innovations and the directions it already explains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drill_env._threads import each
from drill_env._types import FloatArray
from drill_env.diagnosis.applied import with_terms
from drill_env.diagnosis.extended import whitened
from drill_env.diagnosis.fit import Fit, Setting, prior
from drill_env.effects.along import Motion
from drill_env.identification.coordinates import solved
from drill_env.identification.prediction_error import Path, path_of
from drill_env.identification.samples import Samples
from drill_env.identification.smoothing import smoothed
from drill_env.parameters import SYMBOLS

ROUNDING = 1e-9
"""Share of a direction's information, of one that the starts explain, that rounding leaves."""


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """A recording with what a score needs of it.

    Attributes:
        samples: as the filter reads them.
        motion: along which terms are evaluated.
        path: the filter's pass.
        white: standardised innovations of the used readings, shape (k,).
        used: which readings are, shape (n, readings).
        nuisance: directions that are known: shared ones, then those of the starts, shape (k, m).
        inner: inverse information of the starts alone.
    """

    samples: Samples
    motion: Motion
    path: Path
    white: FloatArray
    used: np.ndarray
    nuisance: FloatArray
    inner: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Linearised:
    """Where scores are taken: a fit, and the directions that it already explains.

    Attributes:
        setting: recordings and parameters.
        fit: the fit.
        known: of each recording.
        cross: inverse information of the shared directions with what was believed of them before,
            shape (m, m).
        dispersion: mean square of the standardised innovations.
        pull: per recording the slopes of the likelihood by torques, shape (n, 2).
    """

    setting: Setting
    fit: Fit
    known: tuple[Known, ...]
    cross: FloatArray
    dispersion: float
    pull: tuple[FloatArray, ...]


def linearised_at(setting: Setting, fit: Fit) -> Linearised:
    """Prepare scores at a fit."""
    jacobian = setting.coordinates.jacobian(fit.vector)

    def known(job: tuple[Samples, FloatArray, Motion]) -> tuple[Known, FloatArray]:
        samples, starts, motion = job
        given = with_terms(samples, fit.terms, fit.rig, motion)
        path = path_of(given, fit.rig, fit.noise, starts, setting.robust, slopes=True)
        shared = whitened(
            given, setting, fit.rig, jacobian, fit.terms, fit.noise, starts, path, motion
        )
        used = path.rows["weight"] > 0
        own = path.slopes[:, :, len(SYMBOLS) :][used]
        own = _by_window(own, used, samples)
        gram = own.T @ own
        # A start that is known moves nothing.
        gram += np.diag(1e-9 * np.diag(gram) + (np.diag(gram) == 0.0))
        shared_used = shared[used]
        unit = 1.0 / np.sqrt(np.diag(gram))
        inner = solved(gram * np.outer(unit, unit), np.eye(len(unit))) * np.outer(unit, unit)
        whole = np.sum(shared_used**2, axis=0)
        shared_used = shared_used - own @ (inner @ (own.T @ shared_used))
        # Of what the starts explain, as the zeros of the encoders explain the friction of a disc
        # that only ever turns one way, rounding is left, and no direction.
        shared_used *= np.sum(shared_used**2, axis=0) > ROUNDING * whole
        white = path.rows["white"][used]
        white = white - own @ (inner @ (own.T @ white))
        pull = smoothed(given, fit.noise, path).pull
        return (
            Known(given, motion, path, white, used, np.hstack([shared_used, own]), inner),
            pull,
        )

    jobs = list(zip(setting.samples, fit.starts, fit.motions, strict=True))
    found = each(known, jobs)
    parts = tuple(k for k, _ in found)
    m = len(fit.gradient)
    # As in the fit itself: else scores grow by what rigs do that nobody believes in.
    information = np.diag(prior(setting, fit.vector, fit.terms)[0])
    information = information + sum(k.nuisance[:, :m].T @ k.nuisance[:, :m] for k in parts)
    scale = 1.0 / np.sqrt(np.where(np.diag(information) > 0.0, np.diag(information), 1.0))
    scaled = information * np.outer(scale, scale) + 1e-9 * np.eye(m)
    cross = solved(scaled, np.eye(m)) * np.outer(scale, scale)
    count = sum(len(k.white) for k in parts)
    dispersion = sum(float(k.white @ k.white) for k in parts) / count
    return Linearised(setting, fit, parts, cross, max(dispersion, 1e-3), tuple(p for _, p in found))


def _by_window(own: FloatArray, used: np.ndarray, samples: Samples) -> FloatArray:
    windows = len(samples.restarts)
    if windows == 1:
        return own
    rows = np.repeat(np.arange(len(samples.t))[:, None], used.shape[1], axis=1)[used]
    window = np.searchsorted(samples.restarts, rows, side="right") - 1
    out = np.zeros((len(own), windows * own.shape[1]))
    for i in range(windows):
        out[window == i, i * own.shape[1] : (i + 1) * own.shape[1]] = own[window == i]
    return out
