"""The tables and grades of a search whose candidates held-out recordings judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from drill_env.diagnosis.result import DiagnosisResult, Grade, Prediction
from drill_env.diagnosis.unseen import Unseen


def with_predictions(result: DiagnosisResult, unseen: Sequence[Unseen]) -> DiagnosisResult:
    """The result with what the rule says of it.

    Args:
        result: of the search.
        unseen: one for each round that was judged.
    """
    if not unseen:
        return result
    names = [e.id for e in result.effects]
    tables = [_table(one, names) for one in unseen]
    weights = {e.id: one.choice.weights.get(e.id) for one in unseen for e in one.entrants}
    effects = [
        replace(e, probability=min(weights[e.id] or e.probability, e.probability))
        if weights.get(e.id)
        else e
        for e in result.effects
    ]
    return replace(result, effects=effects, predictions=tables, grades=_grade(unseen[0], names))


def _table(one: Unseen, kept: Sequence[str]) -> list[Prediction]:
    rows = sorted((e.row for e in one.entrants), key=lambda row: -row.gain)
    return [
        Prediction(
            row.id, row.gain, row.error, row.z, list(row.by_lead), row.numbers,
            min(one.choice.weights.get(row.id, 0.0), 1.0), row.id in kept,
        )
        for row in rows
    ]  # fmt: skip


def _grade(one: Unseen, names: Sequence[str]) -> Grade | None:
    """Of what the windows take, if it is what was found."""
    taken, grades = one.choice.chosen, one.choice.grades
    if taken is None or (taken.named and taken.id not in names):
        return None
    return Grade(
        taken.component, grades.component, taken.depends_on, grades.depends_on,
        taken.id if taken.named else "", grades.law if taken.named else 0.0, one.choice.share,
    )  # fmt: skip
