"""Fit of a rig together with terms: joint damped Gauss-Newton, noise estimated anew."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.terms import Shape, Term, corrected, with_terms
from drill_env.effects.along import Motion
from drill_env.identification.coordinates import POSITIVE, Coordinates
from drill_env.identification.noise import NoiseModel
from drill_env.identification.prediction_error import (
    Path,
    Samples,
    Trace,
    path_of,
    value_of,
)
from drill_env.identification.smoothing import slopes_of, smoothed
from drill_env.parameters import SYMBOLS, Rig

THREADS = 2
# Sizes of free shapes: Nm at the discs, share of the brake's torque, rad of a reading.
_USUAL_SHAPE = {"upper": 1.0, "lower": 0.03, "string": 0.03, "friction": 0.5, "sensor": 0.1}
_RIG_STEP = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """What a fit works on.

    Attributes:
        samples: recordings.
        coordinates: free parameters of the rig.
        doubt: relative standard deviation of the parameters around the start. Where the rig fits
            it is far too wide to matter; where physics is missing it keeps the rig sensible.
        robust: standard deviations beyond which an innovation loses weight.
        jitter: of the samples' times, s, where the readings are weighted by it.
    """

    samples: tuple[Samples, ...]
    coordinates: Coordinates
    doubt: float = 0.05
    robust: float = 5.0
    jitter: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A rig with terms and noise, and the likelihood there.

    Attributes:
        vector: coordinates of the rig, shape (free,).
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

    @property
    def numbers(self) -> int:
        """How many numbers the terms have."""
        return sum(len(term.q) for term in self.terms)

    @property
    def bic(self) -> float:
        """Bayesian information criterion, rig parameters left out as all fits share them."""
        return self.value + self.numbers * math.log(max(self.count, 2))


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """One recording's share."""

    value: float
    gradient: FloatArray
    information: FloatArray
    start_step: FloatArray
    start_slope: FloatArray
    count: int
    trace: Trace


def motion_of(samples: Samples, noise: NoiseModel, path: Path) -> Motion:
    """The motion that all samples together tell, once the readings are corrected."""
    states = smoothed(samples, noise, path).states[:, :4]
    rates = np.gradient(states[:, 1:3], samples.t, axis=0)
    return Motion(samples.t, samples.u, np.hstack([states, rates]), samples.restarts)


def whitened(
    samples: Samples, setting: Setting, fit_rig: Rig, jacobian: FloatArray, terms: Sequence[Term],
    noise: NoiseModel, path: Path, motion: Motion,
) -> FloatArray:  # fmt: skip
    """Columns (coordinates, terms' numbers, starts) of the linear regression, shape (n, 2, m)."""
    places = [SYMBOLS.index(name) for name in setting.coordinates.free]
    slopes = path.rows["slopes"]
    columns = [slopes[:, :, places] @ jacobian]
    for term in terms:
        loads, errors = term.slopes(fit_rig, motion)
        columns.append(slopes_of(samples, noise, path, loads, errors))
        by_rig = _slopes_by_rig(setting, fit_rig, term, motion)
        if by_rig is not None:
            columns[0] = columns[0] + slopes_of(samples, noise, path, by_rig, None)
    return np.concatenate(columns, axis=2)


def _slopes_by_rig(setting: Setting, rig: Rig, term: Term, motion: Motion) -> FloatArray | None:
    """How a term's torques follow the rig's coordinates, shape (n, 2, free)."""
    if isinstance(term.source, Shape):
        return None
    free = setting.coordinates.free
    names = [name for name in term.source.effect.follows if name in free]
    if not names:
        return None
    base = term.source.response(term.q, rig, motion)[0]
    out = np.zeros((*base.shape, len(free)))
    for name in names:
        value = getattr(rig, name)
        step = _RIG_STEP * max(abs(value), 1e-6)
        moved = rig.replace(**{name: value + step})
        out[:, :, free.index(name)] = (term.source.response(term.q, moved, motion)[0] - base) / step
    return out @ setting.coordinates.jacobian(setting.coordinates.vector(rig))


def _part(
    samples: Samples, setting: Setting, rig: Rig, jacobian: FloatArray, terms: tuple[Term, ...],
    noise: NoiseModel, starts: FloatArray, motion: Motion,
) -> _Part:  # fmt: skip
    given = with_terms(samples, terms, rig, motion)
    path = path_of(given, rig, noise, starts, setting.robust, slopes=True)
    columns = whitened(given, setting, rig, jacobian, terms, noise, path, motion)
    count = columns.shape[2]
    used = path.rows["weight"] > 0
    x, white = columns[used], path.rows["white"][used]
    gradient, information = x.T @ white, x.T @ x
    known = samples.spreads <= 0.0
    weights, miss = _start_prior(samples, starts)
    steps, slopes = np.zeros_like(starts), np.zeros((*starts.shape, count))
    edges = [*samples.restarts.tolist(), len(samples.t)]
    inner_columns = path.rows["slopes"][:, :, len(SYMBOLS) :]
    for i in range(len(starts)):
        rows = slice(edges[i], edges[i + 1])
        free = np.flatnonzero(~known[i])
        here = used[rows]
        z, w = inner_columns[rows][here][:, free], path.rows["white"][rows][here]
        inner = z.T @ z + np.diag(weights[i, free])
        across = np.linalg.solve(inner, z.T @ columns[rows][here])
        pull = z.T @ w + (weights[i] * miss[i])[free]
        steps[i, free] = np.linalg.solve(inner, pull)
        slopes[i, free] = across
        gradient = gradient - across.T @ pull
        information = information - across.T @ inner @ across
    value = path.value + lost_value(samples, given, path.value, int(used.sum()))
    value += float(np.sum(weights * miss**2))
    return _Part(value, gradient, information, steps, slopes, int(used.sum()), path.trace)


def lost_value(samples: Samples, given: Samples, value: float, used: int) -> float:
    """What angles that a term takes out of a recording would have added, were they as the rest."""
    lost = int(np.isfinite(samples.angles).sum() - np.isfinite(given.angles).sum())
    return lost * value / max(used, 1)


def evaluate(
    setting: Setting, vector: FloatArray, terms: tuple[Term, ...], noise: NoiseModel,
    starts: Sequence[FloatArray], motions: Sequence[Motion],
) -> Fit:  # fmt: skip
    """Likelihood and its derivatives at a rig with terms.

    Raises:
        InputError: the coordinates make no rig.
    """
    rig = setting.coordinates.rig(vector)
    jacobian = setting.coordinates.jacobian(vector)
    jobs = list(zip(setting.samples, starts, motions, strict=True))
    with ThreadPoolExecutor(THREADS) as pool:
        parts = list(
            pool.map(lambda j: _part(j[0], setting, rig, jacobian, terms, noise, j[1], j[2]), jobs)
        )
    weight, miss = _prior(setting, vector, terms)
    gradient = np.sum([p.gradient for p in parts], axis=0) + weight * miss
    information = np.sum([p.information for p in parts], axis=0) + np.diag(weight)
    value = sum(p.value for p in parts) + float(weight @ miss**2)
    return Fit(
        vector, rig, terms, noise, tuple(starts), tuple(motions), value, gradient, information,
        tuple(p.start_step for p in parts), tuple(p.start_slope for p in parts),
        sum(p.count for p in parts), tuple(p.trace for p in parts),
    )  # fmt: skip


def value_at(
    setting: Setting, vector: FloatArray, terms: tuple[Term, ...], noise: NoiseModel,
    starts: Sequence[FloatArray], motions: Sequence[Motion],
) -> float:  # fmt: skip
    """The value of `evaluate` without its derivatives, at a third of the work."""
    rig = setting.coordinates.rig(vector)

    def one(job: tuple[Samples, FloatArray, Motion]) -> float:
        samples, start, motion = job
        given = with_terms(samples, terms, rig, motion)
        path = path_of(given, rig, noise, start, setting.robust)
        weights, miss = _start_prior(samples, start)
        used = int((path.rows["weight"] > 0).sum())
        lost = lost_value(samples, given, path.value, used)
        return path.value + lost + float(np.sum(weights * miss**2))

    jobs = list(zip(setting.samples, starts, motions, strict=True))
    with ThreadPoolExecutor(THREADS) as pool:
        value = sum(pool.map(one, jobs))
    weight, miss = _prior(setting, vector, terms)
    return value + float(weight @ miss**2)


def _start_prior(samples: Samples, starts: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Precisions of the starts, 0 for what is known, and how far they are from the first guess."""
    known = samples.spreads <= 0.0
    weights = np.where(known, 0.0, 1.0 / np.where(known, 1.0, samples.spreads) ** 2)
    return weights, np.where(known, 0.0, samples.starts - starts)


def _prior(
    setting: Setting, vector: FloatArray, terms: Sequence[Term]
) -> tuple[FloatArray, FloatArray]:
    """Precisions of (coordinates, terms' numbers) and how far these are from their centres."""
    centre = setting.coordinates.vector(setting.coordinates.base)
    stiff = [_stiffness(term) for term in terms]
    numbers = [-term.q for term in terms]
    return (
        np.concatenate([prior_weight(setting, centre), *stiff]),
        np.concatenate([centre - vector, *numbers]),
    )


def _stiffness(term: Term) -> FloatArray:
    """Precision of a term's numbers around 0: what the rig's own parameters can do, they do."""
    if not isinstance(term.source, Shape):
        return np.zeros(len(term.q))
    sort = "friction" if term.source.sort == "friction" else term.source.component
    return np.full(len(term.q), 1.0 / _USUAL_SHAPE[sort] ** 2)


def prior_weight(setting: Setting, centre: FloatArray) -> FloatArray:
    """Precision of each coordinate around the start, shape (free,)."""
    base = setting.coordinates.base
    # Asymmetries may be as large as a tenth of what they are asymmetries of.
    scales = {"dTsu": base.Tsu, "dbu": base.bu}
    spread = [
        1.0 if name in POSITIVE else max(2.0 * abs(value), scales.get(name, 0.0), 1e-6)
        for name, value in zip(setting.coordinates.free, centre.tolist(), strict=True)
    ]
    return 1.0 / (setting.doubt * np.array(spread)) ** 2


def strain(setting: Setting, here: Fit) -> float:
    """How far the rig was pulled from the start, in squared standard deviations."""
    centre = setting.coordinates.vector(setting.coordinates.base)
    return float(prior_weight(setting, centre) @ (here.vector - centre) ** 2)


def unstrained(setting: Setting, here: Fit) -> Fit:
    """The point with the rig that was given in place of the fitted one."""
    centre = setting.coordinates.vector(setting.coordinates.base)
    there = evaluate(setting, centre, here.terms, here.noise, here.starts, here.motions)
    return with_new_motions(setting, there)


def with_new_motions(setting: Setting, here: Fit) -> Fit:
    """The point with its motions told by the filter with the terms."""
    jobs = list(zip(setting.samples, here.starts, here.motions, strict=True))

    def again(job: tuple[Samples, FloatArray, Motion]) -> Motion:
        given = with_terms(job[0], here.terms, here.rig, job[2])
        path = path_of(given, here.rig, here.noise, job[1], setting.robust)
        return motion_of(given, here.noise, path)

    with ThreadPoolExecutor(THREADS) as pool:
        motions = list(pool.map(again, jobs))
    return evaluate(setting, here.vector, here.terms, here.noise, here.starts, motions)


def moved_starts(setting: Setting, here: Fit, term: Term) -> list[FloatArray]:
    """The starts when the first readings were misread as a term says."""
    starts = []
    for samples, start, motion in zip(setting.samples, here.starts, here.motions, strict=True):
        error = term.source.response(term.q, here.rig, motion)[1][samples.restarts]
        moved = start.copy()
        moved[:, 0] -= error[:, 0] - error[:, 1]
        moved[:, 3] -= error[:, 1]
        starts.append(moved)
    return starts


def added(setting: Setting, here: Fit, term: Term) -> Fit:
    """The point with one more term."""
    here = replace(here, motions=tuple(corrected(term, m) for m in here.motions))
    starts = moved_starts(setting, here, term)
    return evaluate(setting, here.vector, (*here.terms, term), here.noise, starts, here.motions)


def own_values(setting: Setting, here: Fit) -> list[float]:
    """Minus twice the log likelihood of each recording at a fit."""
    jobs = list(zip(setting.samples, here.starts, here.motions, strict=True))

    def one(job: tuple[Samples, FloatArray, Motion]) -> float:
        given = with_terms(job[0], here.terms, here.rig, job[2])
        return value_of(given, here.rig, here.noise, job[1], setting.robust)

    with ThreadPoolExecutor(THREADS) as pool:
        return list(pool.map(one, jobs))


def gain_of(setting: Setting, here: Fit, term: Term, own: Sequence[float] | None = None) -> float:
    """Fall of minus twice the log likelihood when a term joins and all else stays.

    Args:
        setting: recordings.
        here: where the term joins.
        term: what joins.
        own: of `own_values`, where many terms are tried.
    """
    own = own or own_values(setting, here)
    here = replace(here, motions=tuple(corrected(term, m) for m in here.motions))
    starts = moved_starts(setting, here, term)

    def change(job: tuple[Samples, float, FloatArray, Motion]) -> float:
        samples, old, new, motion = job
        after = with_terms(samples, (*here.terms, term), here.rig, motion)
        value = value_of(after, here.rig, here.noise, new, setting.robust)
        count = int(np.isfinite(after.angles).sum())
        return old - value - lost_value(samples, after, value, count)

    jobs = list(zip(setting.samples, own, starts, here.motions, strict=True))
    with ThreadPoolExecutor(THREADS) as pool:
        total = sum(pool.map(change, jobs))
    return total if math.isfinite(total) else -math.inf


def without(setting: Setting, here: Fit, place: int) -> Fit:
    """The point with one term fewer."""
    terms = tuple(t for i, t in enumerate(here.terms) if i != place)
    return evaluate(setting, here.vector, terms, here.noise, here.starts, here.motions)
