"""The detective: from recordings to what the rig's model leaves out."""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from threadpoolctl import threadpool_limits

from drill_env._errors import InputError
from drill_env._watch import ASKED, Report, Watch
from drill_env.diagnosis.answer import Unseen, answer
from drill_env.diagnosis.base import cleaned_base
from drill_env.diagnosis.bounded import bounded, check_told
from drill_env.diagnosis.by_prediction import PredictionDiagnosis, diagnose_by_prediction
from drill_env.diagnosis.clock import cleaned
from drill_env.diagnosis.declare import extended_rig
from drill_env.diagnosis.evidence import Weighed, decided
from drill_env.diagnosis.explained import that_explain
from drill_env.diagnosis.faults import find_faults
from drill_env.diagnosis.find import find_beside
from drill_env.diagnosis.follows import follow, only_if_they_follow
from drill_env.diagnosis.held_out import Judged, judge_all, judged_channels, rms
from drill_env.diagnosis.law import LawFit, find_with_laws
from drill_env.diagnosis.noise_floor import errors_by_noise
from drill_env.diagnosis.offered import free_parameters, offered_effects
from drill_env.diagnosis.one_law import one_law
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.diagnosis.predicted import with_predictions
from drill_env.diagnosis.result import DiagnosisResult
from drill_env.diagnosis.rounds import Found, outdone
from drill_env.diagnosis.sentences import ended_early
from drill_env.diagnosis.unexplained_residual import with_residual_torque
from drill_env.effects.declared import declared
from drill_env.identification.coasting import left_out_of_search
from drill_env.identification.drive import (
    as_given,
    driven_rig,
    motion_driven,
    torque_driven,
    with_known_scale,
)
from drill_env.identification.known_loads import tells_scale
from drill_env.identification.readings import made_of_twist
from drill_env.identification.samples import Samples, prepare
from drill_env.parameters import Rig
from drill_env.prediction.criteria import Criteria
from drill_env.recordings import Recording

# Share of the time that the search may take; judging took 9 to 24 % of twelve concealed cases.
_SEARCH = 0.75
# And that by windows, with what went before: where it ended early, 7 to 21 s more went by on opened
# axes, with the time to begin.
_BY_WINDOWS = 0.8
# Share of the time for a whole rig whose driven disc may be asked alone afterwards, which ends at
# `_BY_WINDOWS`: on two real joints of an arm it took 33 and 43 s, so of 120 s 53 are left at most.
# It holds until a name leads: of the joints' ends, which no disc on a brake moves as, no name did.
_WHOLE = 0.5
# 5 s predictions with another friction law that are so many times as far off, all of them, refute
# it; with a right but faint effect they were 1.1 times as far.
_FAR_WORSE = 1.25


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosis:
    """A diagnosis with what it was made of.

    Attributes:
        result: plain values.
        found: the search.
        start: the rig that was given.
        rig: the rig with the effects that were found.
        before: held-out recordings under the fitted rig alone.
        after: held-out recordings under the fitted rig with its terms.
        holdout: names of the held-out recordings.
        held: these recordings, ready for the filter.
    """

    result: DiagnosisResult
    found: Found
    start: Rig
    rig: Rig
    before: tuple[Judged, ...]
    after: tuple[Judged, ...]
    holdout: tuple[str, ...]
    held: tuple[Samples, ...]


AnyDiagnosis = TypeVar("AnyDiagnosis", Diagnosis, PredictionDiagnosis)


def diagnose(
    recordings: Sequence[Recording],
    rig: Rig,
    holdout: Sequence[Recording] = (),
    *,
    options: DiagnosisOptions | None = None,
    report: Report = lambda text: None,
) -> Diagnosis | PredictionDiagnosis:
    """Find what a rig's model leaves out of recordings, and show that it was missing.

    Args:
        recordings: with u and theta_u or theta_l, or velocities, to fit; of long ones the first
            rows are read, `drill_env.diagnosis.bounded.MOST_ROWS` of all.
        rig: where to start; its parameters are free but for Ju, the scale of torque, or for km
            where the drive is a measured torque: then km is 1. Where the drive is unknown, all of
            the upper disc are held, and Jl is the scale. Its effects are part of it.
        holdout: recordings to judge on; without them the gain is that of the fit.
        options: how to search.
        report: told what is done next; where it returns True, the search ends with what it knows.

    Raises:
        InputError: no recordings, a channel is missing, or an argument is out of range.
    """
    options = options or DiagnosisOptions()
    if not recordings:
        raise InputError("diagnose needs at least one recording to fit")
    recordings, holdout = bounded(recordings, holdout)
    by_windows = Watch(report, _BY_WINDOWS * options.seconds)
    driven_rig(rig, [*recordings, *holdout])
    if rig.inertias == 1:
        return _told(
            diagnose_by_prediction(recordings, rig, holdout, options, by_windows), by_windows
        )
    declared(rig)
    check_told([*recordings, *holdout])
    # The matrices are small: threads of the linear algebra would only wait for each other.
    alone = _may_be_asked_alone(recordings, rig, holdout)
    seconds = (_WHOLE if alone else 1.0) * options.seconds
    first, judged = (Watch(report, s * seconds) for s in (_SEARCH, 1.0))

    def led() -> None:
        # Where a name leads, the whole rig is what there is to ask.
        first.seconds, judged.seconds = _SEARCH * options.seconds, options.seconds

    with threadpool_limits(1):
        whole = _diagnose(recordings, holdout, rig, options, first, judged.over, led)
    whole = _told(whole, first if first.ended else judged)
    known = whole.result.verdict != "unexplained" or first.ended == ASKED
    if known or not alone or by_windows.over():
        return whole
    fitted = (whole.found.setting, whole.found.base) if holdout else None
    driven = diagnose_by_prediction(recordings, rig, holdout, options, by_windows, fitted=fitted)
    named = driven.result.effects
    if not named or outdone(whole.found, named[0].id, Criteria().share):
        # An error of the other end's sensor looks like a torque of the string, and so of the drive.
        return whole
    return _told(driven, by_windows)


def _told(found: AnyDiagnosis, watch: Watch) -> AnyDiagnosis:
    """A diagnosis that says so where its search was ended early."""
    if not watch.ended:
        return found
    sentences = [*found.result.sentences, ended_early(watch.ended)]
    return replace(found, result=replace(found.result, complete=False, sentences=sentences))


def _may_be_asked_alone(
    recordings: Sequence[Recording], rig: Rig, holdout: Sequence[Recording]
) -> bool:
    """Whether the driven disc's torque and the string's other end were measured.

    Then all that moves the driven disc is known, though the other end may move as no disc on a
    brake does.
    Effects that are known may be behind it: then the whole rig alone is asked.
    """
    every = [*recordings, *holdout]
    known = rig.effects or any(r.effects for r in every)
    return torque_driven(every) and not known and all(len(r.angles()) == 2 for r in every)


def _check_channels(held: Sequence[Samples]) -> None:
    judged_by = [judged_channels(s) for s in held]
    for samples, channels in zip(held, judged_by, strict=True):
        if channels != judged_by[0]:
            raise InputError(
                f"{samples.recording.source} is judged by {' and '.join(channels)}, "
                f"{held[0].recording.source} by {' and '.join(judged_by[0])}: "
                "hold out recordings with the same channels"
            )


def _scale(samples: Sequence[Samples], fixed: Container[str]) -> str:
    """The parameter that sets the scale of torque; none where something known in Nm does."""
    recordings = [s.recording for s in samples]
    if motion_driven(recordings):
        return "" if "ktheta" in fixed or tells_scale(recordings) else "Jl"
    if torque_driven(recordings) or "km" in fixed:
        return "km"
    return "" if tells_scale(recordings) else "Ju"


def _diagnose(
    recordings: Sequence[Recording], holdout: Sequence[Recording], rig: Rig,
    options: DiagnosisOptions, report: Report, over: Callable[[], bool],
    named: Callable[[], None],
) -> Diagnosis:  # fmt: skip
    every, given = [*recordings, *holdout], rig.replace(**options.fixed)
    options = replace(options, fixed=with_known_scale(every, options.fixed))
    rig = driven_rig(rig, every).replace(**options.fixed)
    relative = made_of_twist(recordings)
    samples = [prepare(r, rig, relative=relative) for r in recordings]
    held = [prepare(r, rig, relative=relative) for r in holdout]
    _check_channels(held)
    measured, moved = torque_driven(every), motion_driven(every)
    free = free_parameters(rig, options.fixed, _scale(samples, options.fixed))
    left_out = (*options.leave_out, *left_out_of_search(recordings))
    library = offered_effects(rig, free, left_out, amplifier=not measured, moved=moved)
    setting, base = cleaned_base(samples, rig, free, options.doubt, report)
    if rig.friction == "humped" or "friction_shape" in options.leave_out:
        law, found = None, find_beside(setting, base, library, options.most, report, named)
    else:
        law, found = find_with_laws(
            setting, base, library, options.most, report, options.fixed, named
        )
    report("judging held-out recordings")
    law, unseen, table = _held_out(*_until(over, found, law), held, options.seed)
    found = unseen.found
    base = law.before if law else found.base
    faults = [f for f in find_faults(found.setting, found.final) if f.id not in options.leave_out]
    result = with_predictions(answer(unseen, base, rig, law, faults, options), table)
    extended = extended_rig(found.final.rig, found.final.terms)
    return Diagnosis(
        result, found, as_given(rig, given, every), as_given(extended, given, every),
        unseen.before, unseen.after, tuple(s.recording.source for s in unseen.samples),
        tuple(unseen.samples),
    )  # fmt: skip


def _until(
    over: Callable[[], bool], found: Found, law: LawFit | None
) -> tuple[Found, LawFit | None]:
    """What was found, with time of its own to be judged in."""
    found = replace(found, setting=replace(found.setting, over=over))
    if law is not None:
        own, setting = _until(over, law.found, None)[0], replace(law.setting, over=over)
        law = replace(law, found=own, setting=setting)
    return found, law


def _held_out(
    plain: Found, law: LawFit | None, held: Sequence[Samples], seed: int
) -> tuple[LawFit | None, Unseen, Weighed | None]:
    """What stands on all recordings, those held out cleaned, and how they are judged.

    A law of friction that bends to the fitted ones alone is none.
    """
    found = law.found if law else plain
    ready = [replace(s, release=found.setting.samples[0].release) for s in held]
    ready = cleaned(ready, found.setting.jitter)
    base, setting = (law.before, law.setting) if law else (found.base, found.setting)
    found, table = decided(found, ready, Criteria())
    before = judge_all(ready, setting, base)
    after = judge_all(ready, found.setting, found.final)
    if law and (_far_further(before, after) or not follow(after)):
        return _held_out(_without(law, plain), None, held, seed)
    drawn = errors_by_noise(ready, found.final, after, seed)
    named = found.final
    found = only_if_they_follow(found, before, after)
    if found.follows:
        found = that_explain(found, before, after, drawn, Criteria())
    if found.final is not named:
        after = judge_all(ready, found.setting, found.final)
    if found.follows:
        found = with_residual_torque(
            found, setting, base, law is not None, before, after, Criteria()
        )
    if found.final is not named:
        after = judge_all(ready, found.setting, found.final)
        drawn = errors_by_noise(ready, found.final, after, seed)
    if law and found.residual_shape is not None:
        return _held_out(_without(law, plain), None, held, seed)
    found = replace(found, one_law=one_law(found, ready, before, after, Criteria()))
    return law, Unseen(found, ready, before, after, drawn), table


def _without(law: LawFit, plain: Found) -> Found:
    """The search with the rig's own law, after the humped one was refuted.

    Where no time was left for it, what gained with the humped law is missing without a name.
    """
    if plain.rounds or not law.found.rounds:
        return plain
    return replace(plain, refuted=law.found.final)


def _far_further(before: Sequence[Judged], after: Sequence[Judged]) -> bool:
    """Whether the 5 s predictions of all that is read are far further off."""
    shares = [
        rms(after, "short", i) / rms(before, "short", i)
        for i in range(2)
        if before and 0.0 < rms(before, "short", i) < math.inf
    ]
    return bool(shares) and not min(shares) <= _FAR_WORSE
