"""The twist at which the encoders agree, and the torques of terms that follow from it.

Encoders begin anywhere, so the twist between their zeros is a number of each start. A torque over
the twist must move with it: a stiffening string's slope is soon larger than the string's own, and
then a fit along a motion with another offset leads further away from round to round.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.applied import as_heavy, effects_of, with_terms
from drill_env.diagnosis.fit import start_prior
from drill_env.diagnosis.terms import Term, at_rest, late_disc
from drill_env.effects.along import Motion
from drill_env.identification.coordinates import solved
from drill_env.identification.known_loads import with_added_inertia
from drill_env.identification.noise import NoiseModel
from drill_env.identification.prediction_error import Path, flat, path_of
from drill_env.identification.samples import OFFSET, Samples
from drill_env.identification.smoothing import slopes_of
from drill_env.parameters import SYMBOLS, Rig

# As where starts are settled without terms, see `settled_starts`.
_ROUNDS, _ENOUGH = 5, 0.1

# Twist over which slopes by it are taken, rad: rounding is 1e-11 of it, a curve's bend 1e-5.
_TURN = 1e-5


def twisted_by_start(samples: Samples, motion: Motion, change: FloatArray) -> Motion:
    """The motion when the encoders agree at another twist.

    Args:
        samples: the recording; where one of the angles is not read, they tell no twist.
        motion: told at some starts.
        change: of that twist after each restart, rad, shape (m,).
    """
    if not (change.any() and np.isfinite(samples.angles[:, :2]).any(axis=0).all()):
        return motion
    edges = np.diff([*samples.restarts.tolist(), len(samples.t)])
    states = motion.states.copy()
    states[:, 0] += np.repeat(change, edges)
    return replace(motion, states=states)


def by_the_offset(
    samples: Samples, terms: Sequence[Term], rig: Rig, noise: NoiseModel, path: Path,
    motion: Motion, number: int,
) -> FloatArray | float:  # fmt: skip
    """How predictions follow the twist at which the encoders agree through what terms make of it.

    Args:
        samples: the recording, with the terms.
        terms: beside the rig's own effects.
        rig: parameters.
        noise: under which the pass was made.
        path: the pass.
        motion: along which the terms act.
        number: of starts.

    Returns:
        Standardised slopes, 1/rad, shape (n, readings); 0 where nothing follows it.
    """
    moved = twisted_by_start(samples, motion, np.full(number, _TURN))
    every = as_heavy((*effects_of(rig), *terms), rig, samples.recording)
    along = [t for t in every if not at_rest(t) and late_disc(t) is None]
    if moved is motion or not along:
        return 0.0
    heavy = with_added_inertia(rig, samples.recording)
    there, here = ([t.source.response(t.q, heavy, m) for t in along] for m in (moved, motion))
    loads, errors = (
        np.sum([a[i] - b[i] for a, b in zip(there, here, strict=True)], axis=0) / _TURN
        for i in range(2)
    )
    told = errors[:, :, np.newaxis] if errors.any() else None
    return slopes_of(samples, noise, path, loads[:, :, np.newaxis], told)[:, :, 0]


@dataclass(frozen=True, slots=True, eq=False)
class Starts:
    """The starts of a recording at their best for whatever else is.

    Attributes:
        steps: Gauss-Newton steps of them while the rest stays, shape (m, 5).
        slopes: what they lose for each unit of the other columns, shape (m, 5, columns).
        gradient: what their moving takes from the gradient by the columns.
        information: and from the information.
    """

    steps: FloatArray
    slopes: FloatArray
    gradient: FloatArray
    information: FloatArray


def without_starts(
    samples: Samples, path: Path, starts: FloatArray, by_offset: FloatArray | float,
    columns: FloatArray,
) -> Starts:  # fmt: skip
    """Take the starts out of the linear regression of a recording's predictions.

    Args:
        samples: the recording.
        path: a pass with slopes.
        starts: where it began, shape (m, 5).
        by_offset: of `by_the_offset`.
        columns: slopes by all else, standardised, shape (n, readings, columns).
    """
    count, used = columns.shape[2], path.rows["weight"] > 0
    known = samples.spreads <= 0.0
    weights, miss = start_prior(samples, starts)
    out = Starts(
        np.zeros_like(starts), np.zeros((*starts.shape, count)), np.zeros(count),
        np.zeros((count, count)),
    )  # fmt: skip
    edges = [*samples.restarts.tolist(), len(samples.t)]
    by_starts = path.slopes[:, :, len(SYMBOLS) :].copy()
    by_starts[:, :, OFFSET] += by_offset
    for i in range(len(starts)):
        rows = slice(edges[i], edges[i + 1])
        here = used[rows]
        z, w = flat(by_starts[rows], here), flat(path.rows["white"][rows], here)
        still = np.zeros(len(known[i]), dtype=np.bool_)
        if edges[i + 1] - edges[i] > 1:
            # A disc that stopped in the first interval, to rest or to turn round: no reading tells
            # the speed that did not outlast it, and a step of it would be anything.
            after = path.trace.state[edges[i] + 1, 1:3]
            stopped = path.rows["stuck"][edges[i] + 1] | (starts[i, 1:3] * after < 0.0)
            still[1:3] = ~known[i, 1:3] & stopped
        out.steps[i, still] = -starts[i, still]
        free = np.flatnonzero(~known[i] & ~still)
        z = z[:, free]
        inner = z.T @ z + np.diag(weights[i, free])
        across = solved(inner, z.T @ flat(columns[rows], here))
        pull = z.T @ w + (weights[i] * miss[i])[free]
        out.steps[i, free] = solved(inner, pull)
        out.slopes[i, free] = across
        out.gradient[:] += across.T @ pull
        out.information[:] += across.T @ inner @ across
    return out


def settled_with(
    samples: Samples, terms: tuple[Term, ...], rig: Rig, noise: NoiseModel, motion: Motion,
    told: FloatArray, robust: float,
) -> tuple[FloatArray, Samples, Path]:  # fmt: skip
    """Starts of greatest likelihood with terms, what these make of the recording, and the pass.

    Args:
        samples: the recording.
        terms: beside the rig's own effects.
        rig: parameters, held.
        noise: held.
        motion: along which the terms act.
        told: starts at which it was told; from these on better ones are sought.
        robust: standard deviations beyond which an innovation loses weight.
    """
    none = np.zeros((*samples.angles.shape, 1))

    def at(starts: FloatArray) -> tuple[float, Motion, Samples, Path]:
        moved = twisted_by_start(samples, motion, (starts - told)[:, OFFSET])
        given = with_terms(samples, terms, rig, moved)
        path = path_of(given, rig, noise, starts, robust, slopes=True)
        weights, miss = start_prior(samples, starts)
        return path.value + float(np.sum(weights * miss**2)), moved, given, path

    starts = told
    value, moved, given, path = at(starts)
    for _ in range(_ROUNDS):
        by_offset = by_the_offset(given, terms, rig, noise, path, moved, len(starts))
        step = without_starts(samples, path, starts, by_offset, none).steps
        there = at(starts + step)
        if not there[0] < value:
            break
        gain, starts = value - there[0], starts + step
        value, moved, given, path = there
        if gain < _ENOUGH:
            break
    return starts, given, path
