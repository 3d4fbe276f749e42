"""The decision rule: which of the candidates of one search is taken, and how sure that is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drill_env.prediction.compare import Row, difference, listed, weighed
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.families import family_of

CREDIBLE = 0.95
"""Probability of the names that are not ruled out."""

LIKELY = 0.5
"""Probability from which something is likelier than not."""


@dataclass(frozen=True, slots=True, eq=False)
class Entrant:
    """A candidate of a search.

    Attributes:
        id: of the candidate.
        component: where it sits.
        depends_on: coordinate that it is a function of.
        named: whether it is an effect of the library and no free shape.
        common: whether most machines have it.
        determined: whether its numbers are inside their ranges and unseen recordings bear it.
        row: how it predicts unseen recordings.
    """

    id: str
    component: str
    depends_on: str
    named: bool
    common: bool
    determined: bool
    row: Row


@dataclass(frozen=True, slots=True)
class Grades:
    """How sure each grade of a finding is, from coarse to fine.

    Attributes:
        component: probability that it sits there.
        depends_on: and is a function of that coordinate.
        family: and is of the same family (`families.py`); 0 of a free shape.
        law: and has that law.
        nearest: of a free shape, names of its place that unseen readings ask for, with the share of
            what it explains, the largest first: such physics with another law.
    """

    component: float
    depends_on: float
    family: float
    law: float
    nearest: tuple[tuple[str, float], ...] = ()


NO_GRADES = Grades(0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """What the rule came to.

    Attributes:
        chosen: the candidate that is taken, a name or a free shape; None if none is listed.
        share: of what the best free shape explains that the name explains.
        grades: how sure it is.
        weights: probability of each listed candidate, by its id.
    """

    chosen: Entrant | None
    share: float
    grades: Grades
    weights: dict[str, float]


def chosen(entrants: Sequence[Entrant], criteria: Criteria) -> Choice:
    """Choose among candidates.

    A candidate is listed if unseen windows ask for it and its numbers are determined; so is a name
    that explains the stated share of what a listed free shape at its component does. Of the names
    that hold 95 % of the probability (`weighed`), first of those that explain this share of what
    the best shape does, one that most machines have is taken, or else the most probable one. The
    shape takes the place of a name if it predicts clearly better and the name explains less; one at
    another component, which is no curve of the name's, if it is likelier than that there is a name.

    Args:
        entrants: names and free shapes.
        criteria: of the decision.
    """
    shapes = [e for e in entrants if not e.named and e.determined and listed(e.row, criteria)]
    names = [
        e
        for e in entrants
        if e.named
        and e.determined
        and (listed(e.row, criteria) or _stands_for(e, shapes, criteria))
    ]
    there = [*names, *shapes]
    if not there:
        return Choice(None, 1.0, NO_GRADES, {})
    shape = max(shapes, key=lambda e: e.row.gain, default=None)
    name = _most_plausible(_weighed(names, criteria), shape, criteria)
    taken, share = name or shape, 1.0
    if name is not None and shape is not None:
        share = min(name.row.gain / shape.row.gain, 1.0)
        if share < criteria.share and _ahead(shape.row, name.row, criteria):
            taken = shape
    assert taken is not None
    # A shape that the name stands for is its own curve, and no rival of it.
    rivals = [e for e in there if e.named or not taken.named or not _covers(taken, e, criteria)]
    rivals = _weighed(rivals, criteria)
    taken = next(e for e in rivals if e.id == taken.id)
    elsewhere = [e for e in rivals if e.named or e.component != taken.component]
    chance = sum(e.row.weight for e in _weighed(elsewhere, criteria) if e.named)
    if taken.named and chance < LIKELY:
        taken, share = max(rivals, key=lambda e: e.row.weight), 1.0
    weights = dict.fromkeys((e.id for e in there), 0.0) | {e.id: e.row.weight for e in rivals}
    return Choice(taken, share, _grades(taken, rivals), weights)


def _weighed(entrants: Sequence[Entrant], criteria: Criteria) -> list[Entrant]:
    """Candidates with their probabilities among each other."""
    odds = [criteria.common if e.common else 1.0 for e in entrants]
    chances = weighed([e.row for e in entrants], odds).tolist()
    pairs = zip(entrants, chances, strict=True)
    return [replace(e, row=replace(e.row, weight=weight)) for e, weight in pairs]


def _covers(name: Entrant, shape: Entrant, criteria: Criteria) -> bool:
    """Whether a name explains nearly all of what a free shape of its component does."""
    same = name.component == shape.component
    return same and name.row.gain >= criteria.share * shape.row.gain


def _stands_for(name: Entrant, shapes: Sequence[Entrant], criteria: Criteria) -> bool:
    """Whether there are shapes at a name's component, and it covers all of them."""
    there = [e for e in shapes if e.component == name.component]
    return bool(there) and all(_covers(name, e, criteria) for e in there)


def _ahead(one: Row, other: Row, criteria: Criteria) -> bool:
    """Whether one predicts clearly better than another; one window has no scatter."""
    beyond = difference(one, other)
    scatter = 0.0 < beyond.error < math.inf
    return beyond.gain >= criteria.gain and (not scatter or beyond.z >= criteria.z)


def _most_plausible(
    names: Sequence[Entrant], shape: Entrant | None, criteria: Criteria
) -> Entrant | None:
    """A name that most machines have, if the recordings do not rule it out, or else the best.

    First of those that explain the stated share of what the best shape does.
    """
    if not names:
        return None
    credible = _credible(names)
    covering = [e for e in credible if shape and e.row.gain >= criteria.share * shape.row.gain]
    asked = covering or credible
    return next((e for e in asked if e.common), asked[0])


def _credible(entrants: Sequence[Entrant]) -> list[Entrant]:
    """The most probable ones that together hold 95 %, the best first."""
    order = sorted(entrants, key=lambda e: -e.row.weight)
    before = np.cumsum([0.0] + [e.row.weight for e in order[:-1]])
    return [e for e, sure in zip(order, before.tolist(), strict=True) if sure < CREDIBLE]


def _grades(taken: Entrant, there: Sequence[Entrant]) -> Grades:
    """Sums of weights over what shares the component, the coordinate, the family and the law."""
    same = [e for e in there if e.component == taken.component]
    on = [e for e in same if e.depends_on == taken.depends_on]
    family = family_of(taken.id)
    kin = [e for e in on if family and family_of(e.id) == family]
    place, coordinate, kind = (
        min(sum(e.row.weight for e in part), 1.0) for part in (same, on, kin)
    )
    names = [] if taken.named else sorted((e for e in on if e.named), key=lambda e: -e.row.gain)
    nearest = tuple((e.id, min(e.row.gain / taken.row.gain, 1.0)) for e in names)
    return Grades(place, coordinate, kind, min(taken.row.weight, 1.0), nearest)
