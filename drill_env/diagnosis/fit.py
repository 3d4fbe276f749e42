"""A fit of a rig with terms: what it works on, where it stands, and what was believed before."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from drill_env._types import FloatArray
from drill_env._watch import never
from drill_env.diagnosis.rig_coordinates import RigCoordinates
from drill_env.diagnosis.terms import Shape, Term
from drill_env.effects.along import Motion
from drill_env.identification.coordinates import POSITIVE
from drill_env.identification.noise import NoiseModel
from drill_env.identification.prediction_error import Trace
from drill_env.identification.samples import Samples
from drill_env.parameters import Rig

# Sizes of free shapes: Nm (damping: Nm s/rad) at the discs of the paper's rig, shares of the
# brake's, the drive's and the string's torque, rad of a reading.
_USUAL_SHAPE = {
    "upper": 1.0, "lower": 0.03, "string": 0.03, "friction": 0.5, "drive": 0.3, "stiffness": 0.5,
    "sensor": 0.1,
}  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """What a fit works on.

    Attributes:
        samples: recordings.
        coordinates: free parameters of the rig, and numbers of the effects in its file.
        doubt: relative standard deviation of the parameters around the start. Where the rig fits
            it is far too wide to matter; where physics is missing it keeps the rig sensible.
        robust: standard deviations beyond which an innovation loses weight.
        jitter: of the samples' times, s, where the readings are weighted by it.
        shown: noise of the encoders, as `NoiseModel` names it, that the readings show by
            themselves, rad.
        wide: noise of the rig alone, under which the filter follows readings that it cannot
            explain.
        over: whether descents are to end where they are.
    """

    samples: tuple[Samples, ...]
    coordinates: RigCoordinates
    doubt: float = 0.05
    robust: float = 5.0
    jitter: float = 0.0
    shown: Mapping[str, float] = field(default_factory=dict)
    wide: NoiseModel | None = None
    over: Callable[[], bool] = never


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A rig with terms and noise, and the likelihood there.

    Attributes:
        vector: coordinates of the rig, and of its file's effects.
        rig: the rig without the terms.
        terms: what is added.
        noise: of all recordings.
        starts: of each recording.
        motions: of each recording, along which the terms are evaluated.
        value: minus twice the log posterior, without its constant.
        gradient: downhill direction in (coordinates, terms' numbers), the starts eliminated.
        information: expected curvature likewise.
        start_steps: Gauss-Newton steps of the starts while the rest stays.
        start_slopes: what they lose for each unit of (coordinates, terms' numbers).
        count: samples predicted.
        traces: of each recording's filter.
        ends: how far below and above its value each of the terms' numbers may be, where profiles
            tell it, shape (numbers, 2).
    """

    vector: FloatArray
    rig: Rig
    terms: tuple[Term, ...]
    noise: NoiseModel
    starts: tuple[FloatArray, ...]
    motions: tuple[Motion, ...]
    value: float
    gradient: FloatArray
    information: FloatArray
    start_steps: tuple[FloatArray, ...]
    start_slopes: tuple[FloatArray, ...]
    count: int
    traces: tuple[Trace, ...]
    ends: FloatArray | None = None

    @property
    def numbers(self) -> int:
        """How many numbers the terms have."""
        return sum(len(term.q) for term in self.terms)

    @property
    def bic(self) -> float:
        """Bayesian information criterion, rig parameters left out as all fits share them."""
        return self.value + self.numbers * math.log(max(self.count, 2))


def start_prior(samples: Samples, starts: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Precisions of the starts, 0 for what is known, and how far they are from the first guess."""
    known = samples.spreads <= 0.0
    weights = np.where(known, 0.0, 1.0 / np.where(known, 1.0, samples.spreads) ** 2)
    return weights, np.where(known, 0.0, samples.starts - starts)


def prior(
    setting: Setting, vector: FloatArray, terms: Sequence[Term]
) -> tuple[FloatArray, FloatArray]:
    """Precisions of (coordinates, terms' numbers) and how far these are from their centres."""
    centre = setting.coordinates.vector(setting.coordinates.base)
    stiff = [_stiffness(term, setting.coordinates.base) for term in terms]
    numbers = [-term.q for term in terms]
    return (
        np.concatenate([prior_weight(setting, centre), *stiff]),
        np.concatenate([centre - vector, *numbers]),
    )


def _stiffness(term: Term, rig: Rig) -> FloatArray:
    """Precision of a term's numbers around 0: what the rig's own parameters can do, they do."""
    if not isinstance(term.source, Shape):
        return np.zeros(len(term.q))
    source = term.source
    usual = _USUAL_SHAPE.get(source.sort) or _USUAL_SHAPE[source.component]
    if source.sort in ("torque", "damping"):
        usual *= max(1.0, _times_the_papers(rig, source.component))
    return np.full(len(term.q), 1.0 / usual**2)


def _times_the_papers(rig: Rig, component: str) -> float:
    """How many times as heavy, or as stiff, a part behind the string is as the paper's."""
    paper = Rig.paper()
    return {"lower": rig.Jl / paper.Jl, "string": rig.ktheta / paper.ktheta}.get(component, 1.0)


def prior_weight(setting: Setting, centre: FloatArray) -> FloatArray:
    """Precision of each coordinate around the start, shape of the vector."""
    coordinates, base = setting.coordinates, setting.coordinates.base
    # Asymmetries may be as large as a tenth of what they are asymmetries of.
    scales = {"dTsu": base.Tsu, "dbu": base.bu}
    spread = [
        1.0 if name in POSITIVE else max(2.0 * abs(value), scales.get(name, 0.0), 1e-6)
        for name, value in zip(coordinates.free, centre.tolist(), strict=False)
    ]
    spread += [1.0] * len(coordinates.given)
    return 1.0 / (setting.doubt * np.array(spread)) ** 2


def strain(setting: Setting, here: Fit) -> float:
    """How far the rig was pulled from the start, in squared standard deviations."""
    centre = setting.coordinates.vector(setting.coordinates.base)
    return float(prior_weight(setting, centre) @ (here.vector - centre) ** 2)
