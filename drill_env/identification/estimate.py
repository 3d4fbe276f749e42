"""Identification of the rig from recordings: parameters, noise and their uncertainty."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias

import numpy as np
from scipy.stats import norm
from threadpoolctl import threadpool_limits

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.identification.coasting import check_coasting
from drill_env.identification.coordinates import Coordinates, free_names, inverse
from drill_env.identification.descent import (
    Point,
    Problem,
    descend,
    point_at,
    reheated,
)
from drill_env.identification.drive import as_given, check_scale, driven_rig, with_known_scale
from drill_env.identification.known_loads import tells_scale
from drill_env.identification.noise import NoiseModel, usual_noise
from drill_env.identification.noise_fit import told
from drill_env.identification.noise_of_recording import first_speeds, noise_shown
from drill_env.identification.prior import Prior
from drill_env.identification.readings import made_of_twist
from drill_env.identification.samples import prepare
from drill_env.identification.sandwich import sandwich_covariance
from drill_env.parameters import Rig
from drill_env.recordings import Recording

FitMethod: TypeAlias = Literal["prediction_error", "multiple_shooting"]
"""Filter with latent torques, or free runs of a window with free initial states."""

NoiseSharing: TypeAlias = Literal["shared", "each"]
"""One noise model for all recordings, or one for each."""

# Wide enough that a filter with a rig 30 % off still follows the recording.
# Of the torques on the upper and the lower disc, in usual ones.
_FIRST_NOISE, _NO_TORQUE = (15.0, 100.0), (5e-5, 5e-5)
_SPREAD = 0.3
_DRAWS = 20_000
_REHEATS = 3


@dataclass(frozen=True, slots=True)
class FitOptions:
    """How recordings are fitted.

    Attributes:
        method: see `FitMethod`.
        window: s between free initial states of multiple shooting.
        noise: see `NoiseSharing`.
        robust: standard deviations beyond which a prediction error loses weight (Huber);
            infinity for plain least squares.
        doubt: standard deviation of the positive parameters' logarithms around the start: a
            weak prior that keeps what the recordings do not tell from running away.
        offset: standard deviation (rad) of the string's twist where both encoders read zero.
        starts: number of starts; all but the first from parameters up to 30 % off.
        seed: of the further starts.
        limit: iterations of each start.
    """

    method: FitMethod = "prediction_error"
    window: float = 5.0
    noise: NoiseSharing = "shared"
    robust: float = 3.5
    doubt: float = 1.0
    offset: float = 0.1
    starts: int = 1
    seed: int = 0
    limit: int = 60

    def __post_init__(self) -> None:
        if self.starts < 1:
            raise InputError(f"starts is {self.starts}: give 1 or more")
        if not self.robust > 0:
            raise InputError(f"robust is {self.robust}: give standard deviations greater than 0")
        if not self.offset >= 0:
            raise InputError(f"offset is {self.offset}: give radians, 0 or greater")


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """A fitted rig.

    Attributes:
        rig: the estimate.
        free: names of the estimated parameters.
        problem: recordings, bounds and priors.
        point: the likelihood's lowest point.
        options: how it was fitted.
        coordinate_covariance: covariance in the fit's coordinates, shape (free, free).
        converged: whether the descent ended by itself.
        iterations: of the descent.
        start_values: minus twice the log posterior that each start reached, shape (starts,).
    """

    rig: Rig
    free: tuple[str, ...]
    problem: Problem
    point: Point
    options: FitOptions
    coordinate_covariance: FloatArray
    converged: bool
    iterations: int
    start_values: FloatArray = field(default_factory=lambda: np.zeros(0))

    @property
    def noise(self) -> tuple[NoiseModel, ...]:
        """The noise model of each recording."""
        return tuple(self.point.noise[group] for group in self.problem.groups)

    @property
    def covariance(self) -> FloatArray:
        """Covariance of the parameters in the order of `free`, shape (free, free)."""
        slopes = self.problem.coordinates.jacobian(self.point.vector)
        return slopes @ self.coordinate_covariance @ slopes.T

    @property
    def correlation(self) -> FloatArray:
        """Correlation of the parameters, shape (free, free)."""
        deviations = np.sqrt(np.diag(self.covariance))
        return self.covariance / np.outer(deviations, deviations)

    @property
    def bic(self) -> float:
        """Bayesian information criterion of rig and noise, without its constant."""
        values = len(told(self.problem.samples, torques=self.problem.torques))
        size = len(self.free) + values * len(self.point.noise)
        return self.point.value + size * math.log(self.point.samples)

    def draws(self, count: int = _DRAWS, seed: int = 0) -> FloatArray:
        """Parameters drawn from the posterior's normal approximation in the coordinates.

        Returns:
            Shape (count, free).
        """
        rng = np.random.default_rng(seed)
        # Symmetric square root: a Cholesky factor fails where a direction is not told at all.
        values, vectors = np.linalg.eigh(self.coordinate_covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        moves = rng.normal(size=(count, len(self.free))) @ root.T
        return self.problem.coordinates.many_values(self.point.vector + moves)

    def intervals(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """Interval of each free parameter: the normal one in the coordinates, carried over.

        Args:
            level: probability that it holds the true value.
        """
        low, high = norm.cdf([-1, 1] * np.array(norm.ppf(0.5 + 0.5 * level)))
        edges = np.quantile(self.draws(), [low, high], axis=0)
        return {n: (float(a), float(b)) for n, a, b in zip(self.free, *edges, strict=True)}


Progress: TypeAlias = Callable[[int, int, float], None]


def identify(
    recordings: Sequence[Recording],
    rig: Rig,
    *,
    free: Sequence[str] | None = None,
    fixed: Mapping[str, float] | None = None,
    prior: Prior | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    options: FitOptions | None = None,
    progress: Progress | None = None,
) -> Estimate:
    """Estimate the parameters of a rig from any number of recordings at once.

    By default each encoder sample is predicted from all before it by a Kalman filter through
    the set-valued rig, with an unknown coloured torque on each disc; the likelihood of the
    prediction errors is climbed with exact sensitivities, and size and colour of the torques
    and the encoders' noise are estimated along with the parameters. Where the recordings carry
    no torque noise this becomes the output-error fit of the free run.

    Args:
        recordings: with u and theta_u or theta_l, or velocities.
        rig: where to start, and the friction law and number of inertias; 30 % off will do.
        free: names of the parameters to estimate, by default all that the law has.
        fixed: parameters given, by name; one torque (such as Ju or km) must be, unless the drive
            is a measured torque (then km is 1 and sets the scale) or a load, an added inertia or a
            known effect tells it. Of recordings whose upper disc is moved by something unknown, one
            of the lower disc or the string must be, such as Jl.
        prior: what is known of parameters beforehand, such as stage 1's result.
        bounds: lowest and highest value of parameters.
        options: how to fit.
        progress: called with (start, iteration, minus twice the log likelihood).

    Raises:
        InputError: an argument is out of range or a channel is missing.
    """
    options = options or FitOptions()
    if not recordings:
        raise InputError("identify needs at least one recording")
    check_coasting(recordings)
    driven, known = driven_rig(rig, recordings), with_known_scale(recordings, fixed or {}, free)
    names = free_names(free, rig, known, scaled=tells_scale(recordings))
    check_scale(recordings, rig, names)
    given, base = rig.replace(**(fixed or {})), driven.replace(**known)
    window = options.window if options.method == "multiple_shooting" else math.inf
    relative = base.inertias == 2 and made_of_twist(recordings)
    samples = tuple(
        prepare(r, base, window=window, offset=options.offset, relative=relative)
        for r in recordings
    )
    problem = Problem(
        samples=samples,
        groups=tuple(range(len(samples))) if options.noise == "each" else (0,) * len(samples),
        coordinates=Coordinates(base, names),
        prior=_checked_prior(prior, names),
        bounds=_checked_bounds(bounds, names),
        torques=options.method == "prediction_error",
        doubt=options.doubt,
    )
    # Threads of the linear algebra would only wait for those of the recordings.
    with threadpool_limits(1):
        found = _best(problem, base, names, options, progress)
    return replace(found, rig=as_given(found.rig, given, recordings))


def _best(
    problem: Problem, base: Rig, names: Sequence[str], options: FitOptions,
    progress: Progress | None,
) -> Estimate:  # fmt: skip
    rng = np.random.default_rng(options.seed)
    best: Estimate | None = None
    reached = []
    for number in range(options.starts):
        vector = problem.coordinates.vector(base if number == 0 else _elsewhere(base, names, rng))
        report = (lambda i, v, n=number: progress(n, i, v)) if progress else None
        found = _from_start(problem, vector, options, report)
        reached.append(found.point.value)
        if best is None or found.point.value < best.point.value:
            best = found
    assert best is not None
    inside = {
        name: min(max(getattr(best.rig, name), low), high)
        for name, (low, high) in problem.bounds.items()
    }
    covariance = best.coordinate_covariance
    if best.problem.torques:
        # The errors of multiple shooting last for a window: no lag of the sandwich covers them.
        covariance = sandwich_covariance(best.problem, best.point)
    return replace(
        best, rig=best.rig.replace(**inside), start_values=np.array(reached),
        coordinate_covariance=covariance,
    )  # fmt: skip


def _from_start(
    problem: Problem,
    vector: FloatArray,
    options: FitOptions,
    report: Callable[[int, float], None] | None,
) -> Estimate:
    first = point_at(problem, vector, _first_noise(problem))
    here, ended, steps = descend(problem, first, limit=options.limit, report=report)
    # Weights would hold a filter back that starts with a wrong rig: only now.
    problem = replace(problem, robust=options.robust)
    here = point_at(problem, here.vector, here.noise, here.starts)
    for _ in range(_REHEATS):
        start = reheated(problem, here) if problem.torques else here
        there, ended, more = descend(problem, start, limit=options.limit, report=report)
        steps += more
        gain = here.value - there.value
        here = there if gain > 0 else here
        if gain < 1.0:
            break
    return Estimate(
        here.rig, problem.coordinates.free, problem, here, options,
        inverse(here.information), ended, steps,
    )  # fmt: skip


def _first_noise(problem: Problem) -> list[NoiseModel]:
    models = []
    for group in range(max(problem.groups) + 1):
        members = [
            s.recording for s, g in zip(problem.samples, problem.groups, strict=True) if g == group
        ]
        model = usual_noise(
            problem.coordinates.base, *(_FIRST_NOISE if problem.torques else _NO_TORQUE)
        )
        model = replace(model, **noise_shown(members, problem.samples[0].relative))
        models.append(replace(model, **first_speeds(members)))
    return models


def _elsewhere(rig: Rig, names: Sequence[str], rng: np.random.Generator) -> Rig:
    factors = rng.uniform(1.0 - _SPREAD, 1.0 + _SPREAD, len(names))
    values = {n: getattr(rig, n) * f for n, f in zip(names, factors.tolist(), strict=True)}
    return rig.replace(**values)


def _checked_prior(prior: Prior | None, names: Sequence[str]) -> Prior:
    prior = prior or Prior()
    for name in prior.names:
        if name not in names:
            raise InputError(f"prior of {name}: it is not among the free ones, {', '.join(names)}")
    return prior


def _checked_bounds(
    bounds: Mapping[str, tuple[float, float]] | None, names: Sequence[str]
) -> dict[str, tuple[float, float]]:
    checked = dict(bounds or {})
    for name, (low, high) in checked.items():
        if name not in names:
            raise InputError(f"bounds of {name}: it is not among the free ones, {', '.join(names)}")
        if not low < high:
            raise InputError(f"bounds of {name} are {low} and {high}: give the lower one first")
    return checked
