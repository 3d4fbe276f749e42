"""The diagnosis of an axis: unseen windows decide what is missing."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from drill_env._types import FloatArray
from drill_env.diagnosis.clock import cleaned
from drill_env.diagnosis.explained import explained_share
from drill_env.diagnosis.intervals import significant
from drill_env.diagnosis.options import DiagnosisOptions
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
from drill_env.diagnosis.sentences import sentences_by_prediction
from drill_env.effects import LIBRARY
from drill_env.identification.drive import torque_driven, with_known_scale
from drill_env.identification.samples import Samples, prepare
from drill_env.identification.torn import with_integrals
from drill_env.parameters import Rig
from drill_env.prediction.candidate import Candidate
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.cut import cut, leads_of, upper_axis
from drill_env.prediction.decide import Choice, Tried, explained
from drill_env.prediction.fit import Fit, Setting, errors_of
from drill_env.prediction.intervals import covariance, deviations
from drill_env.prediction.offer import candidates_for, free_names
from drill_env.prediction.search import Fold, folds_of
from drill_env.recordings import Recording

Report = Callable[[str], None]
_Z = 1.959964


@dataclass(frozen=True, slots=True, eq=False)
class PredictionDiagnosis:
    """A diagnosis by prediction with what it was made of.

    Attributes:
        result: plain values.
        choices: one for each round of the search.
        before: the rig alone, fitted to the recordings that were given for that.
        after: with what was found.
        fold: those recordings, and the unseen ones.
        leads: times ahead, s.
        start: the given rig.
        rig: with what was found.
    """

    result: DiagnosisResult
    choices: tuple[Choice, ...]
    before: Fit
    after: Fit
    fold: Fold
    leads: FloatArray
    start: Rig
    rig: Rig


def diagnose_by_prediction(
    recordings: Sequence[Recording], rig: Rig, holdout: Sequence[Recording],
    options: DiagnosisOptions, report: Report = lambda text: None,
    criteria: Criteria | None = None,
) -> PredictionDiagnosis:  # fmt: skip
    """Find what a rig's model leaves out of recordings.

    Of a rig with a string the upper disc is looked at, the lower one moving as it was measured.

    Args:
        recordings: with the drive and the angle of each disc, to fit.
        rig: where to start; its effects are part of it.
        holdout: recordings to judge by; without them each recording is cut in two.
        options: of the diagnosis.
        report: told what is being done.
        criteria: of the decision.

    Raises:
        InputError: the recordings do not fit the rig or are too short.
    """
    criteria = criteria or Criteria()
    fixed = with_known_scale([*recordings, *holdout], options.fixed)
    rig = rig.replace(**fixed)
    if not holdout:
        recordings, holdout = _halves(recordings)
    with threadpool_limits(1):
        report("reading the motion")
        seen, unseen = (_ready(group, rig) for group in (recordings, holdout))
        amplifier = not torque_driven(recordings)

        def look(horizon: float) -> tuple[list[Choice], tuple[Fit, ...], Fold, FloatArray]:
            leads = leads_of(min((seen, unseen), key=_seconds), criteria, horizon)
            report(f"predicting {leads[-1]:.2g} s ahead")
            folds = _folds(seen, unseen, rig, leads, fixed, options, criteria)
            motions = [c.windows.motion for c in folds[0].setting.cuts]
            axis = upper_axis(rig)
            offered = candidates_for(
                axis, motions, options.leave_out, amplifier=amplifier, pulled=rig.inertias == 2
            )
            choices, fits = explained(folds, offered, criteria, options.most, report)
            return choices, fits, folds[0], leads

        choices, fits, fold, leads = look(criteria.horizons[0])
        for horizon in criteria.horizons[1:]:
            if any(c.chosen is not None for c in choices):
                break
            choices, fits, fold, leads = look(horizon)
        report("intervals")
        before = choices[0].found.before[0] if choices else fits[0]
        result = _result(choices, before, fits[0], fold, leads, options)
    return PredictionDiagnosis(
        result, tuple(choices), before, fits[0], fold, leads, rig, fits[0].rig
    )


def _folds(
    seen: Sequence[Samples], unseen: Sequence[Samples], rig: Rig, leads: FloatArray,
    fixed: Mapping[str, float], options: DiagnosisOptions, criteria: Criteria,
) -> tuple[Fold, ...]:  # fmt: skip
    pulled = rig.inertias == 2
    cuts, other = (
        tuple(cut(s, rig, leads, pulled=pulled) for s in group) for group in (seen, unseen)
    )
    free = free_names(rig, fixed, pulled=pulled)
    return folds_of(Setting(rig, free, options.doubt, cuts, criteria), other)


def _ready(recordings: Sequence[Recording], rig: Rig) -> list[Samples]:
    """Without stale rows, a velocity's integral in place of an angle that was not recorded."""
    return cleaned([prepare(with_integrals(r), rig) for r in recordings])


def _seconds(samples: Sequence[Samples]) -> float:
    return sum(float(s.t[-1]) for s in samples)


def _halves(recordings: Sequence[Recording]) -> tuple[list[Recording], list[Recording]]:
    """Each recording's first and second half."""
    parts = [(r.part(0, len(r) // 2), r.part(len(r) // 2, len(r))) for r in recordings]
    return [a for a, _ in parts], [b for _, b in parts]


def _result(
    choices: Sequence[Choice], before: Fit, after: Fit, fold: Fold, leads: FloatArray,
    options: DiagnosisOptions,
) -> DiagnosisResult:  # fmt: skip
    spread = covariance(after)
    kept = [c for c in choices if c.chosen is not None and not c.remainder]
    named = [c for c in kept if c.named]
    errors = _fit(before, after, fold, leads)
    share = _explained(errors["prediction"]) if named else 1.0
    effects_of = [c.chosen.candidate.effect for c in named if c.chosen is not None]
    common = any(e is not None and e.common for e in effects_of)
    stands = common or share >= fold.setting.criteria.share
    effects = [_effect(c, after, i, spread) for i, c in enumerate(kept) if c.named and stands]
    last = kept[-1] if kept and not kept[-1].named else None
    changed = _changes(after, spread)
    verdict: Verdict = "consistent"
    if last is not None or not stands:
        verdict = "unexplained"
    elif named:
        verdict = "missing_physics"
    elif options.given_rig and significant(changed):
        verdict = "parameters"
    first = kept[0] if kept else None
    shape = _shape(last.chosen, after) if last is not None and last.chosen is not None else None
    result = DiagnosisResult(
        verdict, None if first is None else _located(first), effects, _alternatives(first), shape,
        changed, errors | ({} if stands else {"explained": share}), {}, _far_off(after), [], None,
        {
            "fit": [c.samples.recording.source for c in fold.setting.cuts],
            "holdout": [c.samples.recording.source for c in fold.unseen],
        },
        _grades(first, stands), [_predictions(c, stands) for c in choices],
    )  # fmt: skip
    return replace(result, sentences=sentences_by_prediction(result))


def _effect(choice: Choice, after: Fit, place: int, spread: FloatArray) -> NamedEffect:
    assert choice.chosen is not None
    effect = LIBRARY[choice.chosen.candidate.id]
    units = {p.name: p.unit for p in effect.parameters}
    numbers = {
        name: Number(value, value - _Z * size, value + _Z * size, units[name])
        for name, (value, size) in deviations(after, place, spread).items()
    }
    return NamedEffect(
        effect.id, effect.component, min(choice.grades.law, 1.0), numbers, effect.formula,
        effect.meaning, list(effect.aliases),
    )  # fmt: skip


def _changes(after: Fit, spread: FloatArray) -> dict[str, Change]:
    """Parameters of the rig before and after, with 95 % intervals."""
    setting, count = after.setting, len(after.setting.free)
    vector = after.vector[:count]
    slopes = setting.coordinates.jacobian(vector)
    sizes = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slopes, spread[:count, :count], slopes), 0))
    values = setting.coordinates.values(vector)
    return {
        name: Change(getattr(setting.start, name), value, value - _Z * size, value + _Z * size)
        for (name, value), size in zip(values.items(), sizes.tolist(), strict=True)
    }


def _far_off(after: Fit) -> list[str]:
    """Numbers of the rig file that the recordings pull as far as they may go."""
    setting = after.setting
    reach = setting.criteria.reach * setting.spread
    pulled = np.abs(after.vector - setting.centre) > 0.99 * reach
    names = [n for n, far in zip(setting.free, pulled[:-1], strict=True) if far]
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


def _shape(chosen: Tried, after: Fit) -> FoundShape:
    entry = chosen.candidate.entry(after.numbers[-1])
    values = np.array(entry["values"])
    return FoundShape(
        chosen.candidate.depends_on, entry["sort"], "as drawn", 1.0, list(entry["knots"]),
        values.tolist(),
    )  # fmt: skip


def _explained(errors: Mapping[str, Any]) -> float:
    """Share of the squared error at the longest lead that is gone; what noise gives is not told."""
    each = [e for name, e in errors.items() if name != "leads_s"]
    first, last = (sum(e[key][-1] ** 2 for e in each) for key in ("before_rms", "after_rms"))
    return explained_share(first, last)


def _grades(first: Choice | None, stands: bool) -> Grade | None:
    if first is None or first.chosen is None:
        return None
    candidate, grades = first.chosen.candidate, first.grades
    if not stands:
        grades = replace(grades, law=0.0)
    return Grade(
        candidate.component, min(grades.component, 1.0), candidate.depends_on,
        min(grades.depends_on, 1.0), candidate.id if first.named and stands else "",
        min(grades.law, 1.0) if first.named else 0.0, first.share,
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
