"""The table and grades of a whole rig whose candidates all recordings judged."""

from __future__ import annotations

import math
from dataclasses import replace

from drill_env.diagnosis.evidence import Weighed
from drill_env.diagnosis.result import DiagnosisResult, Grade, Prediction
from drill_env.diagnosis.sentences import nearest_of, verdict_sentence
from drill_env.prediction.families import family_of


def with_predictions(result: DiagnosisResult, table: Weighed | None) -> DiagnosisResult:
    """The result with what the rule says of it.

    Args:
        result: of the search.
        table: evidence of the first round, if there was one.
    """
    if table is None:
        return result
    names, grade = [e.id for e in result.effects], _grade(table, result)
    told = replace(result, predictions=[_rows(table, names)], grades=grade)
    lines = [verdict_sentence(told), *result.sentences[1:], *nearest_of(grade)]
    return replace(told, sentences=lines)


def _rows(table: Weighed, kept: list[str]) -> list[Prediction]:
    rows = sorted((e.row for e in table.entrants), key=lambda row: -row.gain)
    return [
        Prediction(
            row.id, row.gain, row.error, row.z if math.isfinite(row.z) else 0.0, list(row.by_lead),
            row.numbers, min(table.choice.weights.get(row.id, 0.0), 1.0), row.id in kept,
        )
        for row in rows
    ]  # fmt: skip


def _grade(table: Weighed, result: DiagnosisResult) -> Grade | None:
    """Of what the rule takes, if it is what was found."""
    taken, grades = table.choice.chosen, table.choice.grades
    names = [e.id for e in result.effects]
    if taken is None or (taken.named and taken.id not in names):
        return None
    law = grades.law if taken.named else 0.0
    own = next((e.probability for e in result.effects if e.id == taken.id), law)
    return Grade(
        taken.component, grades.component, taken.depends_on, grades.depends_on,
        family_of(taken.id), grades.family, taken.id if taken.named else "", min(law, own),
        table.choice.share, dict(grades.nearest),
    )  # fmt: skip
