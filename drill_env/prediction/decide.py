"""The decision: what is missing, how finely it can be told, and what else it may be."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drill_env.prediction.candidate import Candidate
from drill_env.prediction.compare import listed, row_of_gains, weighed
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.fit import Fit, fit
from drill_env.prediction.search import Fold, Round, Tried, searched

Report = Callable[[str], None]
# Standard errors behind the best from which a model is ruled out: 95 % of a normal.
_CONFIDENT = 1.96


@dataclass(frozen=True, slots=True)
class Grades:
    """How sure each grade of a finding is, from coarse to fine.

    Attributes:
        component: probability that it sits there.
        depends_on: and is a function of that coordinate.
        law: and has that law.
    """

    component: float
    depends_on: float
    law: float


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """What one round came to.

    Attributes:
        found: the round.
        chosen: the candidate that is taken, a name or a free shape; None if none is listed.
        share: of what the best free shape explains that the name explains.
        grades: how sure it is.
        remainder: whether it is too small beside what was found first to be more than a rest of it.
    """

    found: Round
    chosen: Tried | None
    share: float = 1.0
    grades: Grades = Grades(0.0, 0.0, 0.0)
    remainder: bool = False

    @property
    def tried(self) -> tuple[Tried, ...]:
        """Names and free shapes."""
        return (*self.found.names, *self.found.shapes)

    @property
    def named(self) -> bool:
        """Whether it has a name."""
        return self.chosen is not None and self.chosen.candidate.effect is not None


def decided(found: Round, criteria: Criteria) -> Choice:
    """Choose among what a round tried.

    A candidate is listed if unseen windows ask for it and its numbers are determined; so is a name
    that explains the stated share of what a listed free shape at its component does. Of those that
    no other predicts clearly better than, a name that most machines have is taken, or else the most
    probable one (`weighed`). A free shape takes the place of a name if it predicts clearly better
    and the name explains less than that share.

    Args:
        found: the round.
        criteria: of the decision.
    """
    shapes = [t for t in found.shapes if listed(t.row, criteria)]
    names = [
        t
        for t in found.names
        if determined(t) and (listed(t.row, criteria) or _stands_for(t, shapes, criteria))
    ]
    tried = [*names, *shapes]
    if not tried:
        return Choice(found, None)
    odds = [criteria.common if common(t.candidate) else 1.0 for t in tried]
    chances = weighed([t.row for t in tried], odds).tolist()
    tried = [_weighted(t, w) for t, w in zip(tried, chances, strict=True)]
    found = replace(found, names=_with(found.names, tried), shapes=_with(found.shapes, tried))
    name = _name(tried)
    shape = max(
        (t for t in tried if t.candidate.effect is None), key=lambda t: t.row.gain, default=None
    )
    chosen, share = name or shape, 1.0
    if name is not None and shape is not None:
        share = min(name.row.gain / shape.row.gain, 1.0)
        beyond = row_of_gains("", 0, shape.row.windows - name.row.windows)
        if share < criteria.share and listed(beyond, criteria):
            chosen = shape
    assert chosen is not None
    return Choice(found, chosen, share, _grades(chosen, tried))


def _stands_for(name: Tried, shapes: Sequence[Tried], criteria: Criteria) -> bool:
    """Whether a name explains nearly all of what a free shape of its component does."""
    there = [t.row.gain for t in shapes if t.candidate.component == name.candidate.component]
    return bool(there) and name.row.gain >= criteria.share * max(there)


def _name(tried: Sequence[Tried]) -> Tried | None:
    """The most plausible of the names that none predicts clearly better than."""
    names = [t for t in tried if t.candidate.effect is not None]
    if not names:
        return None
    best = max(names, key=lambda t: t.row.gain)
    behind = {t.candidate.id: row_of_gains("", 0, best.row.windows - t.row.windows) for t in names}
    near = [t for t in names if t is best or behind[t.candidate.id].z < _CONFIDENT]
    usual = [t for t in near if common(t.candidate)]
    return max(usual or near, key=lambda t: t.row.weight)


def common(candidate: Candidate) -> bool:
    """Whether it is physics that most machines have."""
    return candidate.effect is not None and candidate.effect.common


def determined(tried: Tried) -> bool:
    """Whether no fold's numbers came to the end of their range."""
    return not any(f.candidates[-1].at_end(f.numbers[-1]) for f in tried.fits)


def explained(
    folds: Sequence[Fold], candidates: Sequence[Candidate], criteria: Criteria, most: int,
    report: Report,
) -> tuple[list[Choice], tuple[Fit, ...]]:  # fmt: skip
    """Look for one thing after another that is missing.

    Args:
        folds: what is fitted and what judges.
        candidates: on offer.
        criteria: of the decision.
        most: things that are looked for.
        report: told what is being done.

    Returns:
        A choice for each round, the last of which may have found nothing, and the fits with all
        that was taken.
    """
    report("fitting the rig alone")
    here = tuple(fit(f.setting, f.setting.centre) for f in folds)
    choices: list[Choice] = []
    while len(choices) < most:
        taken = {c.chosen.candidate.id for c in choices if c.chosen is not None}
        offered = [c for c in candidates if c.id not in taken]
        choice = decided(searched(folds, here, offered, report), criteria)
        first = choices[0].chosen if choices else None
        if choice.chosen is not None and first is not None:
            small = choice.chosen.row.gain < criteria.neighbour * first.row.gain
            # What a free shape adds to a name is how its law differs.
            choice = replace(choice, remainder=small or not choice.named)
        choices.append(choice)
        if choice.chosen is None or choice.remainder:
            break
        here = choice.chosen.fits
        if not choice.named:
            break
    return choices, here


def _weighted(tried: Tried, weight: float) -> Tried:
    return replace(tried, row=replace(tried.row, weight=weight))


def _with(old: Sequence[Tried], weighted: Sequence[Tried]) -> tuple[Tried, ...]:
    new = {t.candidate.id: t for t in weighted}
    return tuple(new.get(t.candidate.id, t) for t in old)


def _grades(chosen: Tried, tried: Sequence[Tried]) -> Grades:
    """Sums of weights over what shares the component, the coordinate and the law."""
    where = chosen.candidate.component
    on = chosen.candidate.depends_on
    weights = np.array([t.row.weight for t in tried])
    same = np.array([t.candidate.component == where for t in tried])
    deep = same & np.array([t.candidate.depends_on == on for t in tried])
    return Grades(float(weights[same].sum()), float(weights[deep].sum()), chosen.row.weight)
