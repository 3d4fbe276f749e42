"""Descent of the likelihood: damped Gauss-Newton on the rig, Fisher scoring on the noise."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from drill_env._errors import InputError
from drill_env._threads import each
from drill_env._types import FloatArray
from drill_env.identification.coordinates import POSITIVE, Coordinates
from drill_env.identification.noise import NoiseModel
from drill_env.identification.noise_fit import noise_step
from drill_env.identification.prediction_error import score
from drill_env.identification.prior import Prior
from drill_env.identification.samples import Samples
from drill_env.parameters import SYMBOLS, Rig

_TRIES = 10
_LEAST_DAMPING = 1e-9
# Of minus twice the log likelihood: far below what one degree of freedom moves it.
_ENOUGH = 0.02
# So much in one step is far from the end: only the noise's sizes are worth their time.
_FAR = 100.0
_HEAT = 5.0
_HOT_STEPS = 6

Report = Callable[[int, float], None]


@dataclass(frozen=True, slots=True)
class Problem:
    """What is estimated from what.

    Attributes:
        samples: recordings.
        groups: for each recording the number of the noise model that it shares.
        coordinates: free parameters.
        prior: what is known of parameters beforehand.
        bounds: lowest and highest value of parameters.
        robust: standard deviations beyond which an innovation loses weight.
        torques: whether latent torques are estimated; else their size is held.
        doubt: standard deviation of the positive parameters' logarithms around the start.
    """

    samples: tuple[Samples, ...]
    groups: tuple[int, ...]
    coordinates: Coordinates
    prior: Prior = field(default_factory=Prior)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    robust: float = math.inf
    torques: bool = True
    doubt: float = math.inf


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """A rig and noise, and the likelihood there.

    Attributes:
        vector: coordinates of the rig, shape (free,).
        rig: the rig.
        noise: one model a group.
        starts: of each recording, see `Samples.starts`.
        value: minus twice the log posterior, without its constant.
        gradient: downhill direction in the coordinates, the starts eliminated, shape (free,).
        information: expected curvature in the coordinates likewise, shape (free, free).
        start_steps, start_slopes: how the starts follow a step, see `Score`.
        samples: angles that were predicted.
    """

    vector: FloatArray
    rig: Rig
    noise: tuple[NoiseModel, ...]
    starts: tuple[FloatArray, ...]
    value: float
    gradient: FloatArray
    information: FloatArray
    start_steps: tuple[FloatArray, ...]
    start_slopes: tuple[FloatArray, ...]
    samples: int


def point_at(
    problem: Problem,
    vector: FloatArray,
    noise: Sequence[NoiseModel],
    starts: Sequence[FloatArray] | None = None,
) -> Point:
    """Evaluate the likelihood; the starts are the first guesses by default.

    Raises:
        InputError: the coordinates make no rig.
    """
    coordinates = problem.coordinates
    rig = coordinates.rig(vector)
    starts = [s.starts for s in problem.samples] if starts is None else starts
    jobs = list(zip(problem.samples, problem.groups, starts, strict=True))
    scores = each(lambda j: score(j[0], rig, noise[j[1]], j[2], problem.robust), jobs)
    columns = [SYMBOLS.index(name) for name in coordinates.free]
    value = sum(s.value for s in scores)
    gradient = np.sum([s.gradient[columns] for s in scores], axis=0)
    information = np.sum([s.information[np.ix_(columns, columns)] for s in scores], axis=0)
    precision = problem.prior.precision_of(coordinates.free)
    miss = problem.prior.miss(rig, coordinates.free)
    value += float(miss @ precision @ miss)
    gradient, information = gradient + precision @ miss, information + precision
    miss, weight = _beyond(problem, rig)
    value += float(weight @ miss**2)
    gradient, information = gradient + weight * miss, information + np.diag(weight)
    slopes = coordinates.jacobian(vector)
    gradient, information = slopes.T @ gradient, slopes.T @ information @ slopes
    logs = np.array([name in POSITIVE for name in coordinates.free]) / problem.doubt**2
    miss = coordinates.vector(coordinates.base) - vector
    return Point(
        vector, rig, tuple(noise), tuple(starts), value + float(logs @ miss**2),
        gradient + logs * miss, information + np.diag(logs),
        tuple(s.start_step for s in scores),
        tuple(s.start_slope[:, :, columns] @ slopes for s in scores),
        sum(s.samples for s in scores),
    )  # fmt: skip


def _beyond(problem: Problem, rig: Rig) -> tuple[FloatArray, FloatArray]:
    """How far each free parameter must come back into its bounds, and the weight of that."""
    miss, weight = np.zeros((2, len(problem.coordinates.free)))
    for i, name in enumerate(problem.coordinates.free):
        if name in problem.bounds:
            low, high = problem.bounds[name]
            value = getattr(rig, name)
            miss[i] = min(max(value, low), high) - value
            # A wall that gives way by a millionth: the steps stay those of a smooth function.
            weight[i] = (1e6 / (high - low)) ** 2 if miss[i] else 0.0
    return miss, weight


def moved_starts(here: Point, step: FloatArray) -> list[FloatArray]:
    """The starts that Gauss-Newton gives to a step of the coordinates."""
    return [
        start + move - slope @ step
        for start, move, slope in zip(here.starts, here.start_steps, here.start_slopes, strict=True)
    ]


def rig_step(problem: Problem, here: Point, damping: float) -> tuple[Point, float]:
    """The best point that damped Gauss-Newton steps reach, and the damping for the next."""
    scale = np.diag(np.diag(here.information) + 1e-12)
    reach = problem.coordinates.reach(here.vector)
    for _ in range(_TRIES):
        damped = here.information + damping * scale
        step = np.asarray(np.linalg.lstsq(damped, here.gradient, rcond=1e-14)[0], dtype=np.float64)
        step /= max(1.0, float((np.abs(step) / reach).max()))
        try:
            starts = moved_starts(here, step)
            there = point_at(problem, here.vector + step, here.noise, starts)
        except (InputError, OverflowError):
            there = None
        if there is not None and there.value < here.value:
            return there, max(damping / 100.0, _LEAST_DAMPING)
        damping = max(10.0 * damping, 1e-5)
    return here, damping


def noise_update(problem: Problem, here: Point, *, sizes: bool = False) -> Point:
    """The point with better noise, or the same point.

    Args:
        problem: what is estimated.
        here: the point.
        sizes: whether only the torques' sizes move, at less than half of the work.
    """
    only = (0, 1) if sizes and problem.torques else None
    models = []
    for group, model in enumerate(here.noise):
        members = [i for i, other in enumerate(problem.groups) if other == group]
        samples, starts = [problem.samples[i] for i in members], [here.starts[i] for i in members]
        models.append(
            noise_step(
                samples,
                starts,
                here.rig,
                model,
                torques=problem.torques,
                robust=problem.robust,
                only=only,
            )  # fmt: skip
        )
    there = point_at(problem, here.vector, models, here.starts)
    return there if there.value < here.value else here


def reheated(problem: Problem, here: Point) -> Point:
    """The rig's lowest point under larger torques, which smooth the likelihood's small dents."""
    hot = [
        replace(model, torque_u=_HEAT * model.torque_u, torque_l=_HEAT * model.torque_l)
        for model in here.noise
    ]
    there, damping = point_at(problem, here.vector, hot, here.starts), 1e-3
    for _ in range(_HOT_STEPS):
        before = there.value
        there, damping = rig_step(problem, there, min(damping, 1.0))
        if before - there.value < 1.0:
            break
    return there


def descend(
    problem: Problem, start: Point, *, limit: int = 60, report: Report | None = None
) -> tuple[Point, bool, int]:
    """Follow the likelihood down until neither rig nor noise gains.

    Returns:
        The lowest point, whether it is one, and the number of iterations.
    """
    here, damping, idle = start, 1e-3, 0
    for done in range(1, limit + 1):
        before = here.value
        here, damping = rig_step(problem, here, min(damping, 1.0))
        moved = before - here.value
        # While the rig is far off, the noise follows at once; later it hardly changes.
        if idle < 1 or moved > 1.0:
            after_rig = here.value
            here = noise_update(problem, here, sizes=moved > _FAR)
            idle = idle + 1 if after_rig - here.value < 0.5 else 0
        if report:
            report(done, here.value)
        if before - here.value < _ENOUGH:
            return here, True, done
    return here, False, limit
