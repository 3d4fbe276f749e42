"""Where to begin with an effect that acts on a disc at rest alone.

It decides when the disc breaks away. A break-away that comes too late is as wrong as one that comes
too early, and what is right lies in a narrow valley that no slope leads to: the likelihood itself
is asked, over sizes as well as shapes.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drill_env._threads import each
from drill_env._types import FloatArray, IntArray
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.fit_changes import gain_of, own_values
from drill_env.diagnosis.joint import WORTH_A_ROUND
from drill_env.diagnosis.linearised import Known, Linearised
from drill_env.diagnosis.terms import Named, Term

# Least size of an amplitude, in usual ones, and the factor from one to the next: no further apart
# than the valley is wide.
_LEAST, _APART = 0.7, 1.2
# Points around which recordings that rest try sizes between, and that they pass to all.
_NEAR, _BETWEEN, _WORTH = 5, (0.9, 0.95, 1.05, 1.1), 6


def best_at_rest(
    linearised: Linearised, source: Named, hope: float = 0.0
) -> tuple[Term, float] | None:
    """The numbers of an effect that make the recordings most likely while the rig stays.

    Args:
        linearised: where the effect joins.
        source: it.
        hope: fall of minus twice the log likelihood that is worth asking all recordings.

    Returns:
        The term, and the fall of minus twice the log likelihood; None where no disc ever rested, or
        no size gains on the recording that rests most its share of what the numbers cost and of
        what is hoped for.
    """
    setting, fit = linearised.setting, linearised.fit
    disc = 0 if source.effect.equation == "upper" else 1
    rested = [
        _rows_before_break_aways(known.path.rows["stuck"][:, disc]) for known in linearised.known
    ]
    if not any(rested):
        return None
    longest = max(_longest_rest(known, disc) for known in linearised.known)
    points = _points(source, _strongest_hold(fit, disc), longest)
    terms = [Term(source, q) for q in points]
    one = alone(setting, fit, int(np.argmax(rested)))
    first = _gains(*one, terms)
    least = WORTH_A_ROUND * len(source.effect.parameters) / len(setting.samples)
    if max(map(_gain, first)) <= max(least, hope * max(rested) / sum(rested)):
        # Where a disc rests most it would show most; no size there gains its share of what its
        # numbers cost, and one of each valley was among them.
        return None
    # While the rig stays, one recording may have its valley elsewhere. Where all that rest gain no
    # more by another, the one that rests most tells it best.
    resting = of_recordings(setting, fit, np.flatnonzero(rested).tolist())
    by_one = _best_near(setting, fit, one, first)
    by_all = _best_near(setting, fit, resting, _gains(*resting, terms))
    return by_all if _gain(by_all) > _gain(by_one) + WORTH_A_ROUND else by_one


def _best_near(
    setting: Setting, fit: Fit, asked: tuple[Setting, Fit], tried: list[tuple[Term, float]]
) -> tuple[Term, float]:
    """The best for all recordings of the points, and sizes between, that some like best."""
    ranked = sorted(tried, key=_gain, reverse=True)
    near = [_resized(term, share) for term, _ in ranked[:_NEAR] for share in _BETWEEN]
    few = sorted([*ranked, *_gains(*asked, near)], key=_gain, reverse=True)[:_WORTH]
    return max(_gains(setting, fit, [term for term, _ in few]), key=_gain)


def _resized(term: Term, share: float) -> Term:
    assert isinstance(term.source, Named)
    sizes = [share if p.role == "amplitude" else 1.0 for p in term.source.effect.parameters]
    return Term(term.source, term.source.bounded(term.q * sizes))


def _rows_before_break_aways(stuck: IntArray) -> int:
    leaves = np.flatnonzero(np.diff(stuck) < 0)
    return int(stuck[: leaves[-1] + 1].sum()) if len(leaves) else 0


def _strongest_hold(fit: Fit, disc: int) -> float:
    """The largest torque (Nm) that pulled at a disc: no friction that it overcame was larger."""
    string = max(float(np.abs(m.states[:, 0]).max()) for m in fit.motions) * fit.rig.ktheta
    drive = max(float(np.abs(m.u).max()) for m in fit.motions) * fit.rig.km
    return string if disc else string + drive


def _longest_rest(known: Known, disc: int) -> float:
    """For how long (s) a disc rested at most."""
    turns = np.flatnonzero(np.diff(known.path.rows["stuck"][:, disc], prepend=0, append=0))
    begins, ends = turns[::2], turns[1::2]
    t = known.samples.t
    return float(np.max(t[np.minimum(ends, len(t) - 1)] - t[begins], initial=0.0))


def _points(source: Named, most: float, longest: float) -> list[FloatArray]:
    """Sizes up to the most, and times up to the first beyond the longest rest.

    A disc that leaves long before such a time tells nothing but the ratio of size and time.
    """
    axes = []
    for p in source.effect.parameters:
        least = _LEAST * p.grid[0]
        count = max(int(math.log(max(most / least, 1.0)) / math.log(_APART)) + 1, 1)
        sizes = tuple((least * _APART ** np.arange(count)).tolist())
        times = p.grid[: 1 + sum(value < longest for value in p.grid)]
        axes.append(sizes if p.role == "amplitude" else times)
    return [source.bounded(np.array(point)) for point in itertools.product(*axes)]


def alone(setting: Setting, fit: Fit, place: int) -> tuple[Setting, Fit]:
    """The setting and the fit of one recording."""
    return of_recordings(setting, fit, (place,))


def of_recordings(setting: Setting, fit: Fit, places: Sequence[int]) -> tuple[Setting, Fit]:
    """The setting and the fit of some recordings.

    Args:
        setting: recordings and free parameters.
        fit: of all of them.
        places: of those that stay.
    """
    return (
        replace(setting, samples=tuple(setting.samples[i] for i in places)),
        replace(
            fit, starts=tuple(fit.starts[i] for i in places),
            motions=tuple(fit.motions[i] for i in places),
        ),
    )  # fmt: skip


def _gains(setting: Setting, fit: Fit, terms: list[Term]) -> list[tuple[Term, float]]:
    own = own_values(setting, fit)
    return each(lambda term: (term, gain_of(setting, fit, term, own)), terms)


def _gain(found: tuple[Term, float]) -> float:
    return found[1]
