"""What recordings tell of a rig, what they leave open, and the former in words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.sparse.csgraph import connected_components

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.identification.coordinates import Coordinates, free_names, inverse
from drill_env.identification.estimate import Estimate
from drill_env.identification.noise import NoiseModel
from drill_env.parameters import SYMBOLS, Rig

SIGMAS = 1.959963984540054
"""Half width of a 95 % interval in standard deviations."""

_WEAK = 0.3
_WIDE = 0.2
_TIED = 0.95
_STEP = 2.0 * math.pi / 8192
ANGLES: Mapping[str, float] = {"theta_u": _STEP, "theta_l": _STEP}
"""Angles that a recording may hold, and the encoder steps taken (rad) before there is one."""

# So vague that it only keeps apart from zero what is not told at all.
_VAGUE = 10.0


@dataclass(frozen=True, slots=True, eq=False)
class Knowledge:
    """What is known of a rig: the part of an estimate that the next experiment builds on.

    Attributes:
        rig: the estimate.
        free: names of the estimated parameters, in the order of `SYMBOLS`.
        information: inverse of the covariance in `coordinates`, shape (free, free).
        noise: of the next recording.
        quanta: angles to be recorded, and the step of each encoder in rad (0 for none).
        sources: recordings behind it.
    """

    rig: Rig
    free: tuple[str, ...]
    information: FloatArray
    noise: NoiseModel = field(default_factory=NoiseModel)
    quanta: Mapping[str, float] = field(default_factory=lambda: ANGLES)
    sources: tuple[str, ...] = ()

    @property
    def coordinates(self) -> Coordinates:
        """The coordinates of `information`."""
        return Coordinates(self.rig, self.free)

    @property
    def slopes(self) -> FloatArray:
        """Derivatives of the parameters by the coordinates, shape (free, free)."""
        return self.coordinates.jacobian(self.coordinates.vector(self.rig))

    @property
    def deviations(self) -> FloatArray:
        """Standard deviations of the parameters, shape (free,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def covariance(self) -> FloatArray:
        """Covariance of the parameters in the order of `free`, shape (free, free)."""
        slopes = self.slopes
        return slopes @ inverse(self.information) @ slopes.T


def knowledge_of(estimate: Estimate) -> Knowledge:
    """What a fit knows, with the noise and the encoders of its recordings."""
    quanta: dict[str, float] = {}
    for samples in estimate.problem.samples:
        for name in samples.recording.angles():
            quanta[name] = max(quanta.get(name, 0.0), samples.recording.quanta.get(name, 0.0))
    return Knowledge(
        rig=estimate.rig,
        free=estimate.free,
        information=inverse(estimate.coordinate_covariance),
        noise=typical_noise(estimate.noise),
        quanta=quanta,
        sources=tuple(s.recording.source for s in estimate.problem.samples),
    )


def weak_knowledge(rig: Rig, *, fixed: Sequence[str] = ("Ju",), doubt: float = _WEAK) -> Knowledge:
    """A rig of which no recording is there yet.

    Args:
        rig: best guess.
        fixed: names of parameters that are given.
        doubt: standard deviation of every other parameter, as a share of its size.
    """
    if not doubt > 0:
        raise InputError(f"doubt is {doubt}: give a share greater than 0")
    free = free_names(None, rig, {name: getattr(rig, name, 0.0) for name in fixed})
    quanta = {name: ANGLES[name] for name in ("theta_u", "theta_l")[: rig.inertias]}
    bare = Knowledge(rig, free, np.zeros((len(free), len(free))), quanta=quanta)
    return replace(bare, information=_vague(bare, doubt))


def residual_shape(knowledge: Knowledge) -> list[str]:
    """In words: parameters whose 95 % interval is wider than 20 %, and those that trade off."""
    if not knowledge.sources:
        return [f"no recording yet: nothing is told of {', '.join(knowledge.free)}"]
    known = bounded(knowledge)
    covariance, deviations = known.covariance, known.deviations
    found = []
    for name in wider_than(known, _WIDE):
        value, half = getattr(known.rig, name), SIGMAS * deviations[known.free.index(name)]
        width = 200.0 * half / _sizes(known)[known.free.index(name)]
        found.append(
            f"{name} is hardly told: {value:.4g} +- {half:.2g} (95 % interval {width:.0f} % wide)"
        )
    for names, highest in _tied(known.free, covariance / np.outer(deviations, deviations)):
        found.append(
            f"{', '.join(names[:-1])} and {names[-1]} trade off (correlation up to "
            f"{highest:.3f}): a combination of them is told better than each"
        )
    return found


def wider_than(knowledge: Knowledge, share: float) -> tuple[str, ...]:
    """Parameters whose 95 % interval is wider than a share of their size."""
    widths = 2.0 * SIGMAS * bounded(knowledge).deviations / _sizes(knowledge)
    return tuple(n for n, w in zip(knowledge.free, widths.tolist(), strict=True) if w > share)


def _tied(names: Sequence[str], correlation: FloatArray) -> list[tuple[list[str], float]]:
    """Groups of correlated parameters, and the highest correlation in each."""
    strength = np.abs(correlation) - np.eye(len(names))
    _, labels = connected_components(strength >= _TIED, directed=False)
    groups = [np.flatnonzero(labels == label) for label in np.unique(labels)]
    return [
        ([names[i] for i in group.tolist()], float(strength[np.ix_(group, group)].max()))
        for group in groups
        if len(group) > 1
    ]


def typical_noise(models: Sequence[NoiseModel]) -> NoiseModel:
    """One noise model for the next recording: the geometric mean."""
    return NoiseModel.from_vector(np.mean([model.vector() for model in models], axis=0))


def _sizes(knowledge: Knowledge) -> FloatArray:
    """Scales of the free parameters; an asymmetry's is its symmetric part; shape (free,)."""
    rig = knowledge.rig
    scales = {n: float(getattr(rig, n)) for n in SYMBOLS} | {"dTsu": rig.Tsu, "dbu": rig.bu}
    return np.maximum(np.abs([scales[n] for n in knowledge.free]), 1e-9)


def _vague(knowledge: Knowledge, doubt: float) -> FloatArray:
    """Information of independent parameters known to a share of their sizes."""
    slopes = knowledge.slopes
    return slopes.T @ np.diag((doubt * _sizes(knowledge)) ** -2) @ slopes


def bounded(knowledge: Knowledge) -> Knowledge:
    """The same with a finite, very wide interval for what is not told at all."""
    information = knowledge.information + _vague(knowledge, _VAGUE)
    return replace(knowledge, information=information)
