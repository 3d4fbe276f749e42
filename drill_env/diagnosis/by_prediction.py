"""The diagnosis of an axis: unseen windows decide what is missing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from threadpoolctl import threadpool_limits

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env._watch import Report, over_by
from drill_env.diagnosis import fit as whole_rig
from drill_env.diagnosis.answer_by_prediction import answer_by_prediction
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.clock import cleaned
from drill_env.diagnosis.held_out import followed, offset_of
from drill_env.diagnosis.offered import free_parameters
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.diagnosis.result import DiagnosisResult
from drill_env.effects.along import Motion
from drill_env.identification.coasting import left_out_of_search
from drill_env.identification.drive import torque_driven, with_known_scale
from drill_env.identification.equation_error import with_integrals
from drill_env.identification.samples import Samples, prepare
from drill_env.parameters import Rig
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.cut import cut, leads_of, upper_axis
from drill_env.prediction.decide import Choice, Explained, explained
from drill_env.prediction.fit import Fit
from drill_env.prediction.motion import motion_as_read
from drill_env.prediction.offer import candidates_for, free_names
from drill_env.prediction.refit import refitted
from drill_env.prediction.search import Fold, folds_of
from drill_env.prediction.setting import Setting
from drill_env.recordings import Recording


@dataclass(frozen=True, slots=True, eq=False)
class PredictionDiagnosis:
    """A diagnosis by prediction with what it was made of.

    Attributes:
        result: plain values.
        choices: one for each round of the search.
        before: the rig alone, fitted to the recordings that were given for that.
        after: with what was found, fitted to these too.
        whole: the same fitted to all recordings, whose numbers are reported.
        fold: those recordings, and the unseen ones.
        leads: times ahead, s.
        start: the given rig.
        rig: with what was found, of `whole`.
    """

    result: DiagnosisResult
    choices: tuple[Choice, ...]
    before: Fit
    after: Fit
    whole: Fit
    fold: Fold
    leads: FloatArray
    start: Rig
    rig: Rig


def diagnose_by_prediction(
    recordings: Sequence[Recording], rig: Rig, holdout: Sequence[Recording],
    options: DiagnosisOptions, report: Report = lambda text: None,
    criteria: Criteria | None = None,
    fitted: tuple[whole_rig.Setting, whole_rig.Fit] | None = None,
) -> PredictionDiagnosis:  # fmt: skip
    """Find what a rig's model leaves out of recordings.

    Of a rig with a string the upper disc is looked at, the lower one moving as it was measured.

    Args:
        recordings: with the drive and the angle of each disc, to fit.
        rig: where to start; its effects are part of it.
        holdout: recordings to judge by; without them each recording is cut in two.
        options: of the diagnosis.
        report: told what is done next, see `Report`.
        criteria: of the decision.
        fitted: the whole rig alone, fitted to `recordings`, if that is known.

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
        if rig.inertias == 2:
            free = free_parameters(rig, fixed, "km")
            fitted = fitted or base_fit(seen, rig, free, options.doubt)
            seen, unseen = _from_one_zero(seen, unseen, *fitted)
        amplifier = not torque_driven(recordings)
        axis, left_out = upper_axis(rig), (*options.leave_out, *left_out_of_search(recordings))
        read = tuple([(s, motion_as_read(s, axis)) for s in group] for group in (seen, unseen))

        def look(horizon: float) -> tuple[Explained, FloatArray]:
            leads = leads_of(min((seen, unseen), key=_seconds), criteria, horizon)
            report(f"predicting {leads[-1]:.2g} s ahead")
            folds = _folds(read, rig, leads, fixed, options, criteria, report)
            motions = [c.windows.motion for c in folds[0].setting.cuts]
            offered = candidates_for(
                axis, motions, left_out, amplifier=amplifier, pulled=rig.inertias == 2
            )
            return explained(folds, offered, criteria, options.most, report), leads

        horizons = _possible(read, rig, criteria)
        found, leads = look(horizons[0])
        for horizon in horizons[1:]:
            if found.told or report("looking less far ahead"):
                break
            found, leads = look(horizon)
        report("fitting all readings")
        fold = found.folds[0]
        before = refitted([found.alone], found.alone.setting.cuts)
        after = refitted(found.fits[:1], fold.setting.cuts)
        whole = refitted(found.fits, (*fold.setting.cuts, *fold.unseen))
        result = answer_by_prediction(found.choices, before, after, whole, fold, leads, options)
    return PredictionDiagnosis(
        result, tuple(found.choices), before, after, whole, fold, leads, rig, whole.rig
    )


def _possible(
    read: Sequence[Sequence[tuple[Samples, Motion]]], rig: Rig, criteria: Criteria
) -> tuple[float, ...]:
    """Horizons for which every recording has a stretch without a gap; the last one regardless."""
    pulled, every = rig.inertias == 2, [pair for group in read for pair in group]
    shortest = [s for s, _ in min(read, key=lambda group: _seconds([s for s, _ in group]))]
    for place, horizon in enumerate(criteria.horizons[:-1]):
        leads = leads_of(shortest, criteria, horizon)
        try:
            for samples, motion in every:
                cut(samples, motion, rig, leads, pulled=pulled)
        except InputError:
            continue
        return criteria.horizons[place:]
    return criteria.horizons[-1:]


def _folds(
    read: Sequence[Sequence[tuple[Samples, Motion]]], rig: Rig, leads: FloatArray,
    fixed: Mapping[str, float], options: DiagnosisOptions, criteria: Criteria, report: Report,
) -> tuple[Fold, ...]:  # fmt: skip
    pulled = rig.inertias == 2
    cuts, other = (
        tuple(cut(s, motion, rig, leads, pulled=pulled) for s, motion in group) for group in read
    )
    free = free_names(rig, fixed, pulled=pulled)
    setting = Setting(rig, free, options.doubt, cuts, criteria, over_by(report))
    return folds_of(setting, other)


def _from_one_zero(
    seen: Sequence[Samples], unseen: Sequence[Samples],
    setting: whole_rig.Setting, base: whole_rig.Fit,
) -> tuple[list[Samples], list[Samples]]:  # fmt: skip
    """The lower angles from where the string is not twisted at the upper encoder's zero.

    Encoders begin anywhere. What twist lies between their zeros the whole rig tells.
    """
    motions = [*base.motions, *(followed(s, setting, base)[0] for s in unseen)]
    moved = []
    for samples, motion in zip((*seen, *unseen), motions, strict=True):
        angles = samples.angles.copy()
        angles[:, 1] -= offset_of(samples, motion.states)
        moved.append(replace(samples, angles=angles))
    return moved[: len(seen)], moved[len(seen) :]


def _ready(recordings: Sequence[Recording], rig: Rig) -> list[Samples]:
    """Without stale rows, a velocity's integral in place of an angle that was not recorded."""
    return cleaned([prepare(with_integrals(r), rig) for r in recordings])


def _seconds(samples: Sequence[Samples]) -> float:
    return sum(float(s.t[-1]) for s in samples)


def _halves(recordings: Sequence[Recording]) -> tuple[list[Recording], list[Recording]]:
    """Each recording's first and second half."""
    parts = [(r.part(0, len(r) // 2), r.part(len(r) // 2, len(r))) for r in recordings]
    return [a for a, _ in parts], [b for _, b in parts]
