"""The answer where unseen windows decide: what was found, in plain values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.intervals import significant
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.diagnosis.repetition import with_repetition
from drill_env.diagnosis.result import (
    Alternative,
    Change,
    DiagnosisResult,
    FoundShape,
    Grade,
    Located,
    NamedEffect,
    Number,
    Prediction,
    Verdict,
)
from drill_env.diagnosis.sentences_by_prediction import sentences_by_prediction
from drill_env.diagnosis.stretches import failing_stretches
from drill_env.diagnosis.window_residual import left_predictable, left_repeating, share_removed
from drill_env.effects import LIBRARY
from drill_env.prediction.candidate import Candidate
from drill_env.prediction.decide import Choice, Tried
from drill_env.prediction.families import family_of
from drill_env.prediction.fit import Fit, errors_of
from drill_env.prediction.intervals import covariance, deviations, quantile
from drill_env.prediction.search import Fold
from drill_env.prediction.shapes import coordinate


def answer_by_prediction(
    choices: Sequence[Choice], before: Fit, after: Fit, whole: Fit, fold: Fold,
    leads: FloatArray, options: DiagnosisOptions,
) -> DiagnosisResult:  # fmt: skip
    """All that is told, in plain values.

    Args:
        choices: one for each round of the search.
        before: the rig alone, fitted.
        after: with what was found.
        whole: the same fitted to all recordings, whose numbers are reported.
        fold: what was fitted, and what judges.
        leads: times ahead, s.
        options: of the diagnosis.
    """
    spread = covariance(whole)
    kept = [c for c in choices if c.chosen is not None and not c.remainder]
    named = [c for c in kept if c.named]
    errors = _fit(before, after, fold, leads)
    ends = [c.at_end(z) for c, z in zip(whole.candidates, whole.numbers, strict=True)]
    standing = [c for c, end in zip(kept, ends, strict=True) if c.named and not end]
    cuts = (*fold.setting.cuts, *fold.unseen)
    if not all(map(_common, standing)):
        share = share_removed(before, after, cuts)
        errors["explained"] = share
        if share < fold.setting.criteria.share:
            standing = list(filter(_common, standing))
    repeats, fails = None, None
    if all(map(_common, kept)):
        errors |= left_predictable(after, cuts)
        fails = failing_stretches(after, fold.setting.cuts, fold.unseen)
    if fails is not None:
        errors["fails"] = {"stretches_s": fails.intervals, "largest": fails.largest}
    if not kept and not {"predictable", "fails"} & set(errors):
        repeats = left_repeating(after, fold.setting.cuts, fold.unseen)
    effects = [_effect(c, whole, i, spread) for i, c in enumerate(kept) if c in standing]
    last = kept[-1] if kept and not kept[-1].named else None
    changed = _changes(whole, spread)
    verdict: Verdict = "consistent"
    if last is not None or len(standing) < len(named) or {"predictable", "fails"} & set(errors):
        verdict = "unexplained"
    elif named:
        verdict = "missing_physics"
    elif options.given_rig and significant(changed):
        verdict = "parameters"
    first = kept[0] if kept else None
    shape = _shape(last.chosen, whole) if last is not None and last.chosen is not None else None
    result = DiagnosisResult(
        verdict, None if first is None else _located(first), effects, _alternatives(first), shape,
        changed, errors, {}, _far_off(whole), [], None,
        {
            "fit": [c.samples.recording.source for c in fold.setting.cuts],
            "holdout": [c.samples.recording.source for c in fold.unseen],
        },
        _grades(first, first in standing),
        [_predictions(c, c in standing or not c.named) for c in choices],
    )  # fmt: skip
    if repeats is not None:
        result = with_repetition(result, repeats, whole.rig.km)
    return replace(result, sentences=sentences_by_prediction(result))


def _common(choice: Choice) -> bool:
    """Whether most machines have it: then it stands beside whatever else is missing."""
    effect = None if choice.chosen is None else choice.chosen.candidate.effect
    return effect is not None and effect.common


def _effect(choice: Choice, whole: Fit, place: int, spread: FloatArray) -> NamedEffect:
    assert choice.chosen is not None
    effect = LIBRARY[choice.chosen.candidate.id]
    units, width = {p.name: p.unit for p in effect.parameters}, quantile(whole)
    numbers = {
        name: Number(value, value - width * size, value + width * size, units[name])
        for name, (value, size) in deviations(whole, place, spread).items()
    }
    return NamedEffect(
        effect.id, effect.component, choice.grades.law, numbers, effect.formula,
        effect.meaning, list(effect.aliases),
    )  # fmt: skip


def _changes(whole: Fit, spread: FloatArray) -> dict[str, Change]:
    """Parameters of the rig as given and as fitted, with 95 % intervals."""
    setting, count = whole.setting, len(whole.setting.free)
    vector, width = whole.vector[:count], quantile(whole)
    slopes = setting.coordinates.jacobian(vector)
    sizes = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slopes, spread[:count, :count], slopes), 0))
    values = setting.coordinates.values(vector)
    out = {
        name: Change(
            getattr(setting.start, name), value, value - width * size, value + width * size
        )
        for (name, value), size in zip(values.items(), sizes.tolist(), strict=True)
    }
    of_effects = zip(setting.given, whole.vector[count : setting.shift].tolist(), strict=True)
    for place, (one, x) in enumerate(of_effects, start=count):
        size = width * abs(one.slope(x)) * math.sqrt(max(float(spread[place, place]), 0.0))
        out[one.label] = Change(one.value, one.at(x), one.at(x) - size, one.at(x) + size)
    return out


def _far_off(whole: Fit) -> list[str]:
    """Numbers of the rig file that the recordings pull as far as they may go."""
    setting = whole.setting
    reach = setting.criteria.reach * setting.spread
    pulled = np.abs(whole.vector - setting.centre) > 0.99 * reach
    names = [n for n, far in zip(setting.names, pulled[:-1], strict=True) if far]
    if not names:
        return []
    return [
        f"The rig file is far off: {', '.join(names)} came to the end of what --doubt "
        f"{setting.doubt:g} allows; measure them, or give a larger --doubt."
    ]


def _located(choice: Choice) -> Located:
    assert choice.chosen is not None
    candidate = choice.chosen.candidate
    return Located(
        candidate.component, _equation(candidate), candidate.depends_on, "", [], {}, None, None,
        {"upper": 0.0, "lower": 0.0}, {"upper": 0.0, "lower": 0.0},
    )  # fmt: skip


def _equation(candidate: Candidate) -> str:
    if candidate.effect is not None:
        return candidate.effect.equation
    return {"lower": "lower", "string": "both"}.get(candidate.component, "upper")


def _alternatives(first: Choice | None) -> list[Alternative]:
    """The other candidates of the first round, the most probable first."""
    if first is None or first.chosen is None:
        return []
    best = first.chosen.row.gain
    others = [t for t in first.tried if t is not first.chosen]
    others.sort(key=lambda t: (-t.row.weight, -t.row.gain))
    return [Alternative(t.candidate.id, t.row.weight, 2.0 * (best - t.row.gain)) for t in others]


def _shape(chosen: Tried, whole: Fit) -> FoundShape:
    entry, name = chosen.candidate.entry(whole.numbers[-1]), chosen.candidate.depends_on
    knots, values = np.array(entry["knots"]), np.array(entry["values"])
    if "period" in entry:
        # The table is kept within its period; reported is where the disc was.
        low = min(float(coordinate(c.windows.motion, name).min()) for c in whole.setting.cuts)
        knots = low + np.mod(knots - low, entry["period"])
    order = np.argsort(knots)
    return FoundShape(
        name, entry["sort"], "as drawn", 1.0, knots[order].tolist(), values[order].tolist()
    )


def _grades(first: Choice | None, stands: bool) -> Grade | None:
    if first is None or first.chosen is None:
        return None
    candidate, grades = first.chosen.candidate, first.grades
    if not stands:
        grades = replace(grades, family=0.0, law=0.0)
    law = candidate.id if first.named and stands else ""
    return Grade(
        candidate.component, grades.component, candidate.depends_on, grades.depends_on,
        family_of(law), grades.family, law, grades.law if first.named else 0.0, first.share,
        dict(grades.nearest),
    )  # fmt: skip


def _predictions(choice: Choice, stands: bool) -> list[Prediction]:
    return [
        Prediction(
            t.candidate.id, t.row.gain, t.row.error, t.row.z, list(t.row.by_lead), t.row.numbers,
            t.row.weight, stands and t is choice.chosen and not choice.remainder,
        )
        for t in sorted(choice.tried, key=lambda t: -t.row.gain)
    ]  # fmt: skip


def _fit(before: Fit, after: Fit, fold: Fold, leads: FloatArray) -> dict:
    """Root mean square errors of unseen windows at each lead, before and after."""
    names = ("theta_u", "theta_l")
    rows = {
        which: np.sqrt(np.mean(errors_of(fit, fold.unseen) ** 2, axis=0))
        for which, fit in (("before_rms", before), ("after_rms", after))
    }
    count = rows["after_rms"].shape[1]
    return {
        "prediction": {
            "leads_s": leads.tolist(),
            **{
                names[c]: {which: rms[:, c].tolist() for which, rms in rows.items()}
                for c in range(count)
            },
        }
    }
