"""Scores of every candidate at once: linear regression of the standardised innovations."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from drill_env._threads import each
from drill_env._types import BoolArray, FloatArray
from drill_env.diagnosis.grids import around, gains_over, grid_of
from drill_env.diagnosis.late_readings import unread
from drill_env.diagnosis.linearised import ROUNDING, Known, Linearised
from drill_env.diagnosis.stiction_starts import best_at_rest
from drill_env.diagnosis.terms import Named, Shape, Term, corrected, late_disc
from drill_env.effects import Effect
from drill_env.effects.along import Motion
from drill_env.identification.prediction_error import flat
from drill_env.identification.smoothing import slopes_of
from drill_env.parameters import Rig

_REFINEMENTS = 3
# Fall of minus twice the log likelihood below which nothing is worth a closer look: what two
# numbers cost (Akaike), and a number and its place in a grid are two.
_DULL = 4.0
# A shape without an amplitude has size 1; a first look along a wrong motion may be off by this.
_LEAST, _MOST = 0.3, 3.0
# Share of a column's information that must be new; less is an alias of what is there.
_ALIAS = 1e-5
# Points of a grid that are scored at once.
_BLOCK = 32
# Of more points than this one recording chooses: a third, no fewer and no more than these.
_MANY, _WORTH = 13, (8, 12)
# Names whose gain is less than this share of what is worth a look get no finer grid: on three
# practice cases the best 16 stayed the same.
_HOPE = 0.5


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


def _moments(
    linearised: Linearised, terms: Sequence[Term], recordings: Sequence[Known] | None = None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Scores, information beyond what is known, and information at all of one block a term.

    Of some recordings alone, they are what all would give if the others were like them.
    """
    rig, noise = linearised.fit.rig, linearised.fit.noise
    told = linearised.known if recordings is None else recordings
    share = len(told) / len(linearised.known)
    m = len(linearised.fit.gradient)

    def one(known: Known) -> tuple[FloatArray, FloatArray, FloatArray]:
        torques, errors = zip(*(_columns(t, rig, known.motion) for t in terms), strict=True)
        columns = slopes_of(
            known.samples, noise, known.path, np.concatenate(torques, 2), np.concatenate(errors, 2)
        )
        columns = flat(columns, known.used)
        # A response that runs away from the motion tells nothing.
        columns[:, ~np.isfinite(np.einsum("ij,ij->j", columns, columns))] = 0.0
        # What the starts explain is taken out of the sums; `white` and the shared directions are
        # free of it already. A column of which only rounding is left tells nothing.
        sums, whole = known.nuisance.T @ columns, columns.T @ columns
        own = sums[m:]
        left = whole - own.T @ (known.inner @ own)
        new = np.diag(left) > ROUNDING * np.diag(whole)
        return (
            new * (columns.T @ known.white), np.outer(new, new) * left, new * sums[:m],
        )  # fmt: skip

    parts = each(one, told)
    score, information, shared = (np.sum([p[i] for p in parts], axis=0) / share for i in range(3))
    # What a step of the known directions alone would still gain is no candidate's.
    along = shared.T @ linearised.cross
    score = score - along @ linearised.fit.gradient
    return score, information - along @ shared, np.diag(information)


def _columns(term: Term, rig: Rig, motion: Motion) -> tuple[FloatArray, FloatArray]:
    if isinstance(term.source, Shape):
        return term.source.slopes(rig, motion)
    effect = term.source.effect
    q = term.q.copy()
    loads, errors = [], []
    for turn in _turns(effect):
        for i, p in enumerate(effect.parameters):
            if p.role == "phase":
                q[i] = turn
        turned = Term(term.source, q)
        torque, error = term.source.response(q, rig, corrected(turned, motion))
        disc = late_disc(turned)
        if disc is not None:
            _hold(error[:, disc], unread(motion, float(q[0])))
        loads.append(torque)
        errors.append(error)
    return np.stack(loads, axis=2), np.stack(errors, axis=2)


def _hold(error: FloatArray, lost: BoolArray) -> None:
    # A jump to nothing where a reading is lost would look like all that there is.
    for row in np.flatnonzero(lost):
        error[row] = error[max(row - 1, 0)]


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
    source: Named, q: FloatArray, score: FloatArray, g: FloatArray, raw: FloatArray
) -> Scored | None:
    """The numbers of one block of columns; None where they would have the wrong sign."""
    effect = source.effect
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
    return Scored(Term(source, source.bounded(q)), gain)


def score_effects(linearised: Linearised, effects: Iterable[Effect], width: int) -> list[Scored]:
    """The best numbers of each effect, best effect first.

    Args:
        linearised: where they join.
        effects: they.
        width: how many of the best are worth a closer look.
    """
    effects = list(effects)
    quick = [effect for effect in effects if not effect.only_at_rest]
    firsts = each(lambda e: best_point(linearised, Named(e), grid_of(e, linearised)), quick)
    found = {e: best for e, best in zip(quick, firsts, strict=True) if best is not None}
    # The likelihood itself, which these are asked by, costs more than any score.
    for effect in [effect for effect in effects if effect.only_at_rest]:
        hope = _hope(found.values(), width) / linearised.dispersion
        held = best_at_rest(linearised, Named(effect), hope)
        if held is not None:
            found[effect] = Scored(held[0], held[1] * linearised.dispersion)
    for level in range(_REFINEMENTS):
        least = max(_hope(found.values(), width), _DULL * linearised.dispersion)
        hopeful = [e for e, s in found.items() if s.gain >= least and _has_grid(e)]
        grids = [(e, around(e, found[e].term.q, level)) for e in hopeful]
        finer = each(lambda grid: best_point(linearised, Named(grid[0]), grid[1]), grids)
        for effect, best in zip(hopeful, finer, strict=True):
            if best is not None and best.gain > found[effect].gain:
                found[effect] = best
    scored = [Scored(s.term, s.gain / linearised.dispersion) for s in found.values()]
    return sorted(scored, key=lambda s: -s.gain)


def _hope(found: Iterable[Scored], width: int) -> float:
    """Gain from which a closer look may bring a name among so many that get one."""
    gains = sorted((s.gain for s in found), reverse=True)
    return _HOPE * max(gains[width - 1], 0.0) if len(gains) >= width else 0.0


def _has_grid(effect: Effect) -> bool:
    """Whether there is anything between the points of an effect's grid."""
    return not effect.only_at_rest and any(p.role == "shape" for p in effect.parameters)


def score_shapes(linearised: Linearised, shapes: Iterable[Shape]) -> list[Scored]:
    """The best numbers of each free shape, best shape first."""
    scored = each(lambda shape: scored_together(linearised, [shape])[0], shapes)
    return sorted(scored, key=lambda s: -s.gain)


def scored_together(linearised: Linearised, shapes: Sequence[Shape]) -> list[Scored]:
    """The best numbers of each of some free shapes, in their order, told in one pass."""
    if not shapes:
        return []
    terms = [Term(shape, np.zeros(shape.size)) for shape in shapes]
    score, g, raw = _moments(linearised, terms)
    scored, begin = [], 0
    for shape in shapes:
        part = slice(begin, begin + shape.size)
        q, gain = _sizes(score[part], g[part, part], raw[part])
        scored.append(Scored(Term(shape, shape.bounded(q)), gain / linearised.dispersion))
        begin = part.stop
    return scored


def information_of(linearised: Linearised, terms: Sequence[Term]) -> FloatArray:
    """Information beyond what is known of each column of terms: of each size, or pair of sizes."""
    return np.diag(_moments(linearised, terms)[1])


def best_point(
    linearised: Linearised, source: Named, points: Sequence[FloatArray]
) -> Scored | None:
    """The numbers that score best of a source at some points, its size and phase free.

    The gain is not yet divided by the dispersion of the linearised.
    """
    if len(points) > _MANY:
        # One recording tells which points are worth the others' time.
        one = [_telling(linearised, source)]
        first = gains_over(
            points, lambda some: [_gain(s) for s in _scored_points(linearised, source, some, one)]
        )
        few, most = _WORTH
        worth = np.argsort(-first)[: min(max(len(points) // 3, few), most)]
        points = [points[i] for i in sorted(worth)]
    return max(_scored_points(linearised, source, points), key=_gain, default=None)


def _telling(linearised: Linearised, source: Named) -> Known:
    """The recording that tells most of an effect."""
    if source.effect.depends_on == "voltage":
        # A limit that no voltage reaches shows nothing.
        return max(linearised.known, key=lambda k: float(np.abs(k.motion.u).max()))
    return max(linearised.known, key=lambda k: float(k.white @ k.white) / len(k.white))


def _gain(scored: Scored | None) -> float:
    return -np.inf if scored is None else scored.gain


def _scored_points(
    linearised: Linearised, source: Named, points: Sequence[FloatArray],
    recordings: Sequence[Known] | None = None,
) -> list[Scored | None]:  # fmt: skip
    width = len(_turns(source.effect))
    scored: list[Scored | None] = []
    for first in range(0, len(points), _BLOCK):
        block = points[first : first + _BLOCK]
        terms = [Term(source, q) for q in block]
        score, g, raw = _moments(linearised, terms, recordings)
        for i, q in enumerate(block):
            part = slice(i * width, (i + 1) * width)
            scored.append(_solve(source, q, score[part], g[part, part], raw[part]))
    return scored
