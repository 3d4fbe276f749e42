"""The likelihood of a rig together with terms, and its derivatives."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from drill_env._threads import each
from drill_env._types import FloatArray
from drill_env.diagnosis.applied import acting, as_heavy, effects_of, with_terms
from drill_env.diagnosis.fit import Fit, Setting, prior, start_prior
from drill_env.diagnosis.start_twist import by_the_offset, without_starts
from drill_env.diagnosis.terms import Named, Term, at_rest
from drill_env.effects.along import Motion
from drill_env.identification.known_loads import with_added_inertia
from drill_env.identification.noise import NoiseModel
from drill_env.identification.prediction_error import Path, Trace, flat, path_of, trace_of
from drill_env.identification.samples import Samples
from drill_env.identification.smoothing import slopes_of, smoothed
from drill_env.parameters import SYMBOLS, Rig


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
    mark = samples.recording.fingerprint()
    return Motion(samples.t, samples.u, np.hstack([states, rates]), samples.restarts, mark)


def whitened(
    samples: Samples, setting: Setting, fit_rig: Rig, jacobian: FloatArray, terms: Sequence[Term],
    noise: NoiseModel, starts: FloatArray, path: Path, motion: Motion,
) -> FloatArray:  # fmt: skip
    """Columns (coordinates, terms' numbers, starts) of the linear regression, shape (n, 2, m)."""
    places = [SYMBOLS.index(name) for name in setting.coordinates.free]
    slopes = path.slopes
    # One product of plain matrices: a stack of small ones is many times slower.
    by_all = np.zeros((slopes.shape[2], jacobian.shape[1]))
    by_all[places] = jacobian
    own = slopes.reshape(-1, slopes.shape[2]) @ by_all
    columns = [own.reshape(*slopes.shape[:2], -1)]
    by_loads = partial(slopes_of, samples, noise, path, errors=None)
    given = effects_of(fit_rig)
    every = as_heavy((*given, *terms), fit_rig, samples.recording)
    heavy = with_added_inertia(fit_rig, samples.recording)
    for place, term in enumerate(every):
        if at_rest(term):
            filtered = partial(
                trace_of, rig=fit_rig, noise=noise, starts=starts, robust=setting.robust
            )
            moved = _moved_predictions(samples, every, place, path.trace.innovation, filtered)
            columns.append(moved * path.rows["weight"][:, :, np.newaxis])
            continue
        below = term.source.response(term.q, heavy, motion)
        loads, errors = term.slopes(heavy, motion, below)
        columns.append(slopes_of(samples, noise, path, loads, errors if errors.any() else None))
        by_parameters = partial(term.slopes_by, rig=heavy, motion=motion, below=below[0])
        columns[0] = columns[0] + _by_the_rig(term, by_parameters, places, jacobian, by_loads)
    by_given = columns[1 : 1 + len(given)]
    for place, column in setting.coordinates.of_effects(fit_rig, by_given):
        columns[0][:, :, place] += column
    return np.concatenate([columns[0], *columns[1 + len(given) :]], axis=2)


def _by_the_rig(
    term: Term, by_parameters: Callable[[list[str]], FloatArray], places: list[int],
    jacobian: FloatArray, by_loads: Callable[[FloatArray], FloatArray],
) -> FloatArray | float:  # fmt: skip
    """How predictions follow the rig's coordinates through what a term makes of its parameters."""
    names = [n for n in term.source.made_of if SYMBOLS.index(n) in places]
    if not names:
        return 0.0
    loads = by_parameters(names)
    told = np.flatnonzero(loads.any(axis=(0, 1)))
    if not len(told):
        return 0.0
    rows = [places.index(SYMBOLS.index(names[i])) for i in told]
    return by_loads(loads[:, :, told]) @ jacobian[rows]


def _moved_predictions(
    samples: Samples, terms: Sequence[Term], place: int, here: FloatArray,
    filtered: Callable[[Samples], Trace],
) -> FloatArray:  # fmt: skip
    """How the predictions follow the numbers of a term that acts within the filter."""
    term, columns = terms[place], []
    assert isinstance(term.source, Named)
    for i, step in enumerate(term.source.probes(term.q).tolist()):
        q = term.q.copy()
        q[i] += step
        moved = [*terms[:place], Term(term.source, q), *terms[place + 1 :]]
        there = filtered(replace(samples, acting=acting(moved))).innovation
        columns.append((here - there) / step)
    return np.stack(columns, axis=2)


# Numbers far off let the filter break down, which `evaluate` sees.
@np.errstate(over="ignore", invalid="ignore")
def _part(
    samples: Samples, setting: Setting, rig: Rig, jacobian: FloatArray, terms: tuple[Term, ...],
    noise: NoiseModel, starts: FloatArray, motion: Motion,
) -> _Part:  # fmt: skip
    given = with_terms(samples, terms, rig, motion)
    path = path_of(given, rig, noise, starts, setting.robust, slopes=True)
    columns = whitened(given, setting, rig, jacobian, terms, noise, starts, path, motion)
    used = path.rows["weight"] > 0
    x, white = flat(columns, used), flat(path.rows["white"], used)
    by_offset = by_the_offset(given, terms, rig, noise, path, motion, len(starts))
    left = without_starts(samples, path, starts, by_offset, columns)
    gradient = x.T @ white - left.gradient
    information = x.T @ x - left.information
    weights, miss = start_prior(samples, starts)
    value = path.value + lost_value(samples, given, path.value, int(used.sum()))
    value += float(np.sum(weights * miss**2))
    return _Part(value, gradient, information, left.steps, left.slopes, int(used.sum()), path.trace)


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
    parts = each(lambda j: _part(j[0], setting, rig, jacobian, terms, noise, j[1], j[2]), jobs)
    weight, miss = prior(setting, vector, terms)
    gradient = np.sum([p.gradient for p in parts], axis=0) + weight * miss
    information = np.sum([p.information for p in parts], axis=0) + np.diag(weight)
    value = sum(p.value for p in parts) + float(weight @ miss**2)
    if not all(np.isfinite(found).all() for found in (gradient, information, value)):
        # Where the filter breaks down there is no way on.
        value = math.inf
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
        weights, miss = start_prior(samples, start)
        used = int((path.rows["weight"] > 0).sum())
        lost = lost_value(samples, given, path.value, used)
        return path.value + lost + float(np.sum(weights * miss**2))

    jobs = list(zip(setting.samples, starts, motions, strict=True))
    value = sum(each(one, jobs))
    weight, miss = prior(setting, vector, terms)
    return value + float(weight @ miss**2)
