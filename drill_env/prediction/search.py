"""Forward search: one candidate after another, judged by recordings that were not fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drill_env._types import FloatArray
from drill_env._watch import Report
from drill_env.effects import LIBRARY
from drill_env.parameters import Rig
from drill_env.prediction.candidate import Candidate
from drill_env.prediction.compare import Row, row_of
from drill_env.prediction.cut import Cut, begun_best
from drill_env.prediction.fit import Fit, fit
from drill_env.prediction.offer import second_gear
from drill_env.prediction.screen import screened
from drill_env.prediction.setting import Setting

# Candidates that are fitted after the first look.
_NAMES, _SHAPES = 12, 3


@dataclass(frozen=True, slots=True, eq=False)
class Tried:
    """A candidate fitted in every fold.

    Attributes:
        candidate: which one.
        fits: with it, one for each fold.
        row: how it predicts what the folds did not fit.
    """

    candidate: Candidate
    fits: tuple[Fit, ...]
    row: Row


@dataclass(frozen=True, slots=True, eq=False)
class Round:
    """One search at one model.

    Attributes:
        before: the model, one fit for each fold.
        names: effects of the library, best first.
        shapes: free shapes, best first.
        complete: whether all that had promise was tried before the time was over.
    """

    before: tuple[Fit, ...]
    names: tuple[Tried, ...]
    shapes: tuple[Tried, ...]
    complete: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class Fold:
    """What is fitted and what judges."""

    setting: Setting
    unseen: tuple[Cut, ...]


def folds_of(setting: Setting, unseen: Sequence[Cut]) -> tuple[Fold, ...]:
    """The split that was given, and its reverse: every recording is unseen once."""
    back = replace(setting, cuts=tuple(unseen))
    return Fold(setting, tuple(unseen)), Fold(back, setting.cuts)


def begun_anew(
    folds: Sequence[Fold], here: Sequence[Fit]
) -> tuple[tuple[Fold, ...], tuple[Fit, ...]]:
    """Folds and fits with windows that begin where the fits predict them best from.

    Args:
        folds: the split that was given, and its reverse.
        here: one fit for each.
    """
    seen, unseen = (
        tuple(
            begun_best(cut, one.rig, float(one.vector[-1]), one.setting.criteria.degrees)
            for cut in one.setting.cuts
        )
        for one in here
    )
    anew = folds_of(replace(folds[0].setting, cuts=seen), unseen)
    pairs = zip(anew, here, strict=True)
    return anew, tuple(fit(f.setting, b.vector, b.candidates, b.numbers) for f, b in pairs)


def without_first(here: Sequence[Fit]) -> tuple[Fit, ...]:
    """Fits without their first candidate."""
    return tuple(fit(b.setting, b.vector, b.candidates[1:], b.numbers[1:]) for b in here)


def searched(
    folds: Sequence[Fold], before: Sequence[Fit], candidates: Sequence[Candidate], report: Report
) -> Round:
    """Look for one more candidate at a model.

    Args:
        folds: what is fitted and what judges.
        before: the model, one fit for each fold.
        candidates: on offer.
        report: told what is done next, see `Report`.
    """
    report("scoring the library")
    candidates = [c for c in candidates if _may_join(c, before[0].rig)]
    looks = [{look.candidate.id: look for look in screened(b, candidates)} for b in before]
    gains = {
        c.id: sum(max(look[c.id].gain, 0.0) if c.id in look else 0.0 for look in looks)
        for c in candidates
        if all(c.id in look for look in looks)
    }
    old = [b.judged(fold.unseen) for b, fold in zip(before, folds, strict=True)]
    tried: dict[bool, list[Tried]] = {True: [], False: []}
    complete = True
    # Noise alone gives half a nat for each number in each fold: no more is worth no fit.
    worth = (c for c in candidates if gains.get(c.id, 0.0) > 0.5 * len(folds) * c.size)
    order = sorted(worth, key=lambda c: -gains[c.id])
    for named, most in ((True, _NAMES), (False, _SHAPES)):
        for candidate in [c for c in order if (c.effect is not None) == named][:most]:
            if report(f"trying {candidate.id}") and tried[named]:
                complete = False
                break
            fits = _fitted(before, candidate, [look[candidate.id].numbers for look in looks])
            tried[named].append(Tried(candidate, fits, _row(candidate, fits, folds, old)))
        tried[named].sort(key=lambda t: -t.row.gain)
    return Round(tuple(before), tuple(tried[True]), tuple(tried[False]), complete)


def _may_join(candidate: Candidate, rig: Rig) -> bool:
    """Whether the motor would not be behind two gears."""
    there = [LIBRARY[e["id"]] for e in rig.effects if e["id"] in LIBRARY]
    return candidate.effect is None or not second_gear(candidate.effect, there)


def _fitted(
    before: Sequence[Fit], candidate: Candidate, starts: Sequence[FloatArray]
) -> tuple[Fit, ...]:
    """A candidate fitted in every fold, from its own start and from where the others came to.

    A descent ends at the peak it began below. What one half of the recordings found may be a higher
    peak of the other half, too; each takes its own highest.
    """
    pairs = list(zip(before, starts, strict=True))
    fits = [_with(b, candidate, start) for b, start in pairs]
    bent = [i for i, kind in enumerate(candidate.kinds) if kind in ("log", "place")]
    if all(np.array_equal(start[bent], starts[0][bent]) for start in starts):
        return tuple(fits)
    found = [f.numbers[-1] for f in fits]
    return tuple(
        max([own, *(_with(b, candidate, there) for there in found if there is not own.numbers[-1])],
            key=lambda one: one.value)
        for b, own in zip(before, fits, strict=True)
    )  # fmt: skip


def _with(before: Fit, candidate: Candidate, numbers: FloatArray) -> Fit:
    candidates, known = (*before.candidates, candidate), (*before.numbers, numbers)
    return fit(before.setting, before.vector, candidates, known)


def _row(
    candidate: Candidate, fits: Sequence[Fit], folds: Sequence[Fold], old: Sequence[FloatArray]
) -> Row:
    new = [f.judged(fold.unseen) for f, fold in zip(fits, folds, strict=True)]
    gains = np.concatenate([a - b for a, b in zip(new, old, strict=True)])
    marks: list[int] = []
    for fold in folds:
        for one in fold.unseen:
            marks += [one.samples.recording.fingerprint()] * len(one.windows.starts)
    return row_of(candidate.id, candidate.size, gains, marks)
