"""Scores of every candidate at once: linear regression of the standardised innovations."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.extended import THREADS, Fit, Setting, whitened
from drill_env.diagnosis.terms import Named, Shape, Term, corrected, with_terms
from drill_env.effects import Effect, EffectParameter
from drill_env.effects.along import Motion
from drill_env.identification.prediction_error import Path, Samples, path_of
from drill_env.identification.smoothing import slopes_of, smoothed
from drill_env.parameters import SYMBOLS

_REFINEMENTS = 3
# A shape without an amplitude has size 1; a first look along a wrong motion may be off by this.
_LEAST, _MOST = 0.3, 3.0
# Share of a column's information that must be new; less is an alias of what is there.
_ALIAS = 1e-5
_PEAKS = 3
_HIGHEST_HZ = 40.0
# Of one turn, for the search of orders.
_BINS = 512


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """A recording with what a score needs of it."""

    samples: Samples
    motion: Motion
    path: Path
    white: FloatArray
    used: np.ndarray
    nuisance: FloatArray
    solved: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """Where scores are taken: a fit, and the directions that it already explains.

    Attributes:
        setting: recordings and parameters.
        fit: the fit.
        known: of each recording.
        cross: inverse information of the shared directions, shape (m, m).
        dispersion: mean square of the standardised innovations.
        pull: per recording the slopes of the likelihood by torques, shape (n, 2).
    """

    setting: Setting
    fit: Fit
    known: tuple[Known, ...]
    cross: FloatArray
    dispersion: float
    pull: tuple[FloatArray, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Scored:
    """A candidate with the numbers that score best.

    Attributes:
        term: the candidate.
        gain: expected fall of minus twice the log likelihood.
        numbers: how many numbers it has.
    """

    term: Term
    gain: float

    @property
    def numbers(self) -> int:
        """How many numbers it has."""
        return len(self.term.q)


def ground_at(setting: Setting, fit: Fit) -> Ground:
    """Prepare scores at a fit."""
    jacobian = setting.coordinates.jacobian(fit.vector)

    def known(job: tuple[Samples, FloatArray, Motion]) -> tuple[Known, FloatArray]:
        samples, starts, motion = job
        given = with_terms(samples, fit.terms, fit.rig, motion)
        path = path_of(given, fit.rig, fit.noise, starts, setting.robust, slopes=True)
        shared = whitened(given, setting, fit.rig, jacobian, fit.terms, fit.noise, path, motion)
        used = path.rows["weight"] > 0
        own = path.rows["slopes"][:, :, len(SYMBOLS) :][used]
        own = _by_window(own, used, samples)
        gram = own.T @ own
        # A start that is known moves nothing.
        gram += np.diag(1e-9 * np.diag(gram) + (np.diag(gram) == 0.0))
        shared_used = shared[used]
        solved = np.asarray(np.linalg.solve(gram, own.T), dtype=np.float64)
        shared_used = shared_used - own @ (solved @ shared_used)
        white = path.rows["white"][used]
        white = white - own @ (solved @ white)
        pull = smoothed(given, fit.noise, path).pull
        return (
            Known(given, motion, path, white, used, np.hstack([shared_used, own]), solved),
            pull,
        )

    jobs = list(zip(setting.samples, fit.starts, fit.motions, strict=True))
    with ThreadPoolExecutor(THREADS) as pool:
        found = list(pool.map(known, jobs))
    parts = tuple(k for k, _ in found)
    m = len(fit.gradient)
    information = sum(k.nuisance[:, :m].T @ k.nuisance[:, :m] for k in parts)
    scale = 1.0 / np.sqrt(np.where(np.diag(information) > 0.0, np.diag(information), 1.0))
    scaled = information * np.outer(scale, scale) + 1e-9 * np.eye(m)
    cross = np.linalg.inv(scaled) * np.outer(scale, scale)
    count = sum(len(k.white) for k in parts)
    dispersion = sum(float(k.white @ k.white) for k in parts) / count
    return Ground(setting, fit, parts, cross, max(dispersion, 1e-3), tuple(p for _, p in found))


def _by_window(own: FloatArray, used: np.ndarray, samples: Samples) -> FloatArray:
    windows = len(samples.restarts)
    if windows == 1:
        return own
    rows = np.repeat(np.arange(len(samples.t))[:, None], 2, axis=1)[used]
    window = np.searchsorted(samples.restarts, rows, side="right") - 1
    out = np.zeros((len(own), windows * own.shape[1]))
    for i in range(windows):
        out[window == i, i * own.shape[1] : (i + 1) * own.shape[1]] = own[window == i]
    return out


def _moments(ground: Ground, terms: Sequence[Term]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Scores, information beyond what is known, and information at all of one block a term."""
    rig, noise = ground.fit.rig, ground.fit.noise
    m = len(ground.fit.gradient)

    def one(known: Known) -> tuple[FloatArray, FloatArray, FloatArray]:
        loads, errors = [], []
        for term in terms:
            torque, error = _columns(term, rig, known.motion)
            loads.append(torque)
            errors.append(error)
        columns = slopes_of(
            known.samples, noise, known.path, np.concatenate(loads, 2), np.concatenate(errors, 2)
        )[known.used]
        own = known.nuisance[:, m:]
        columns = columns - own @ (known.solved @ columns)
        shared = known.nuisance[:, :m]
        return columns.T @ known.white, columns.T @ columns, shared.T @ columns

    with ThreadPoolExecutor(THREADS) as pool:
        parts = list(pool.map(one, ground.known))
    score, information, shared = (np.sum([p[i] for p in parts], axis=0) for i in range(3))
    return score, information - shared.T @ ground.cross @ shared, np.diag(information)


def _columns(term: Term, rig, motion: Motion) -> tuple[FloatArray, FloatArray]:  # noqa: ANN001
    if isinstance(term.source, Shape):
        return term.slopes(rig, motion)
    effect = term.source.effect
    q = term.q.copy()
    loads, errors = [], []
    for turn in _turns(effect):
        for i, p in enumerate(effect.parameters):
            if p.role == "phase":
                q[i] = turn
        torque, error = term.source.response(q, rig, corrected(Term(term.source, q), motion))
        loads.append(torque)
        errors.append(error)
    return np.stack(loads, axis=2), np.stack(errors, axis=2)


def _turns(effect: Effect) -> tuple[float, ...]:
    turned = any(p.role == "phase" for p in effect.parameters)
    return (0.0, -0.5 * np.pi) if turned else (0.0,)


def _sizes(score: FloatArray, g: FloatArray, raw: FloatArray) -> tuple[FloatArray, float]:
    """Numbers of a block of columns and their gain; what the fit already explains stays out."""
    unit = 1.0 / np.sqrt(np.maximum(raw, 1e-300))
    values, vectors = np.linalg.eigh(g * np.outer(unit, unit))
    kept = values > _ALIAS
    along = vectors[:, kept].T @ (unit * score) / values[kept]
    return unit * (vectors[:, kept] @ along), float(along @ (values[kept] * along))


def _solve(
    effect: Effect, q: FloatArray, score: FloatArray, g: FloatArray, raw: FloatArray
) -> Scored | None:
    """The numbers of one block of columns; None where they would have the wrong sign."""
    size, gain = _sizes(score, g, raw)
    if not gain > 0.0:
        return None
    q = q.copy()
    roles = [p.role for p in effect.parameters]
    if len(size) == 2:
        # a cos(x) + b sin(x) = c cos(x - atan2(b, a)); the second column is that of -pi/2.
        q[roles.index("phase")] = -np.arctan2(size[1], size[0])
        q[roles.index("amplitude")] *= float(np.hypot(*size))
    elif "amplitude" in roles:
        place = roles.index("amplitude")
        q[place] *= float(size[0])
        if q[place] < effect.parameters[place].low:
            return None
    else:
        factor = float(size[0])
        if factor <= 0.0:
            return None
        factor = min(max(factor, _LEAST), _MOST)
        gain = float(2.0 * factor * score[0] - factor**2 * g[0, 0])
    return Scored(Term(Named(effect), Named(effect).bounded(q)), gain)


def score_effects(ground: Ground, effects: Iterable[Effect]) -> list[Scored]:
    """The best numbers of each effect, best effect first."""
    scored = []
    for effect in effects:
        best = _score_grid(ground, effect, _grid(effect, ground))
        for _ in range(_REFINEMENTS):
            if best is None or all(p.role != "shape" for p in effect.parameters):
                break
            finer = _score_grid(ground, effect, _around(effect, best.term.q, _))
            if finer is not None and finer.gain > best.gain:
                best = finer
        if best is not None:
            scored.append(Scored(best.term, best.gain / ground.dispersion))
    return sorted(scored, key=lambda s: -s.gain)


def score_shapes(ground: Ground, shapes: Iterable[Shape]) -> list[Scored]:
    """The best numbers of each free shape, best first."""
    scored = []
    for shape in shapes:
        term = Term(shape, np.zeros(shape.size))
        q, gain = _sizes(*_moments(ground, [term]))
        scored.append(Scored(Term(shape, q), gain / ground.dispersion))
    return sorted(scored, key=lambda s: -s.gain)


def _score_grid(ground: Ground, effect: Effect, points: list[FloatArray]) -> Scored | None:
    if not points:
        return None
    width = len(_turns(effect))
    best: Scored | None = None
    for first in range(0, len(points), 32):
        block = points[first : first + 32]
        score, g, raw = _moments(ground, [Term(Named(effect), q) for q in block])
        for i, q in enumerate(block):
            part = slice(i * width, (i + 1) * width)
            found = _solve(effect, q, score[part], g[part, part], raw[part])
            if found is not None and (best is None or found.gain > best.gain):
                best = found
    return best


def _grid(effect: Effect, ground: Ground) -> list[FloatArray]:
    axes = []
    for p in effect.parameters:
        values = p.grid
        if p.name == "frequency" and effect.id.endswith("_disturbance"):
            disc = 0 if effect.equation == "upper" else 1
            values = tuple(sorted({*values, *_frequencies(ground, disc)}))
        if p.name == "order" and len(p.grid) > 4:
            values = tuple(sorted({*values, *_orders(ground, p)}))
        if p.name == "time":
            end = max(float(k.motion.t[-1]) for k in ground.known)
            values = tuple(np.arange(0.02, 0.99, 0.03) * end)
        axes.append(values)
    return [np.array(point) for point in itertools.product(*axes)]


def _frequencies(ground: Ground, disc: int) -> list[float]:
    """Frequencies (Hz) at which a torque would explain most, from the likelihood's slopes."""
    total, longest = None, max(len(p) for p in ground.pull)
    size = 2 * longest
    for pull in ground.pull:
        power = np.abs(np.fft.rfft(pull[:, disc], size)) ** 2
        total = power if total is None else total + power
    assert total is not None
    interval = ground.known[0].samples.recording.interval
    hertz = np.fft.rfftfreq(size, interval)
    wide = max(int(0.02 * len(total)), 5)
    kernel = np.ones(wide) / wide
    relative = total / (np.convolve(total, kernel, mode="same") + 1e-300)
    relative[(hertz < 0.03) | (hertz > min(_HIGHEST_HZ, 0.45 / interval))] = 0.0
    found: list[float] = []
    for place in np.argsort(-relative)[:200]:
        value = float(hertz[place])
        if all(abs(value - other) > 3.0 / (longest * interval) for other in found):
            found.append(value)
        if len(found) == _PEAKS:
            break
    return [f + d / (longest * interval) for f in found for d in (-0.25, 0.0, 0.25)]


def _orders(ground: Ground, p: EffectParameter) -> list[float]:
    """Orders in theta_u at which a torque on the upper disc would explain most."""
    lowest, highest = p.grid[0], min(1.5 * p.grid[-1], _BINS / 4.0)
    spans = [_turned(known) for known in ground.known]
    longest = max(float(np.ptp(angle)) for angle in spans) + 1.0
    size = int(2 ** np.ceil(np.log2(2.0 * longest * _BINS / (2.0 * np.pi))))
    total = np.zeros(size // 2 + 1)
    for pull, angle in zip(ground.pull, spans, strict=True):
        place = np.floor((angle - angle.min()) * _BINS / (2.0 * np.pi)).astype(np.int64)
        binned = np.bincount(place, weights=pull[:, 0], minlength=size)[:size]
        total += np.abs(np.fft.rfft(binned)) ** 2
    order = np.arange(len(total)) * _BINS / size
    wide = max(int(0.02 * len(total)), 5)
    relative = total / (np.convolve(total, np.ones(wide) / wide, mode="same") + 1e-300)
    relative[(order < lowest) | (order > highest)] = 0.0
    apart = 4.0 * np.pi / longest
    found: list[float] = []
    for place in np.argsort(-relative)[:200]:
        value = float(order[place])
        if all(abs(value - other) > apart for other in found):
            found.append(value)
        if len(found) == _PEAKS:
            break
    return [n + d * apart for n in found for d in (-0.25, 0.0, 0.25)]


def _turned(known: Known) -> FloatArray:
    return known.motion.states[:, 3] + known.motion.states[:, 0]


def _around(effect: Effect, q: FloatArray, level: int) -> list[FloatArray]:
    """Points between a grid point and its neighbours, finer at each level."""
    points = []
    for i, p in enumerate(effect.parameters):
        if p.role != "shape":
            continue
        for share in (-0.5, -0.25, 0.25, 0.5):
            moved = q.copy()
            moved[i] = _between(p, q[i], share * 0.4**level)
            points.append(moved)
    unit = []
    for point in points:
        # Amplitudes are scored from their usual size.
        for i, p in enumerate(effect.parameters):
            if p.role != "shape":
                point[i] = p.grid[0]
        unit.append(point)
    return unit


def _between(p: EffectParameter, value: float, share: float) -> float:
    if p.name in ("time", "order"):
        # A peak over the angle is as narrow as the recordings' turns are many.
        spread = 2.0 if p.name == "time" else 0.05
        return max(value + share * spread, p.low)
    if p.name == "frequency" and len(p.grid) > 12:
        return value + share * 0.02
    grid = np.array(p.grid)
    ratio = float(grid[-1] / grid[0]) ** (1.0 / max(len(grid) - 1, 1))
    return min(max(value * ratio**share, max(p.low, 1e-9)), p.high)
