"""The answer on a whole rig: what was found, in plain values."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.faults import Fault
from drill_env.diagnosis.fit import Fit
from drill_env.diagnosis.held_out import Judged, judged_channels, rms
from drill_env.diagnosis.intervals import changes, significant
from drill_env.diagnosis.law import LawFit
from drill_env.diagnosis.locate import describe, locate
from drill_env.diagnosis.named import named_effects
from drill_env.diagnosis.next_experiment import next_experiment
from drill_env.diagnosis.noise_floor import noise_floor
from drill_env.diagnosis.offered import is_parameter
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.diagnosis.probability import rivals
from drill_env.diagnosis.repetition import with_repetition
from drill_env.diagnosis.result import (
    Alternative,
    Change,
    DiagnosisResult,
    Located,
    NamedEffect,
    Verdict,
)
from drill_env.diagnosis.rounds import BELIEVED, Found, is_named
from drill_env.diagnosis.sentences import sentences
from drill_env.diagnosis.terms import Term
from drill_env.identification.drive import gives_scale
from drill_env.identification.known_loads import tells_scale
from drill_env.identification.samples import Samples
from drill_env.parameters import Rig


@dataclass(frozen=True, slots=True, eq=False)
class Unseen:
    """What was found, and the recordings that were held out under it.

    Attributes:
        found: the search, decided.
        samples: the recordings.
        before: how these are judged under the rig alone.
        after: and under what was found.
        drawn: errors that noise gives, of `errors_by_noise`.
    """

    found: Found
    samples: list[Samples]
    before: tuple[Judged, ...]
    after: tuple[Judged, ...]
    drawn: dict[str, list[FloatArray]]


def answer(
    unseen: Unseen, base: Fit, start: Rig, law: LawFit | None, faults: list[Fault],
    options: DiagnosisOptions,
) -> DiagnosisResult:  # fmt: skip
    """All that is found, in plain values.

    Args:
        unseen: what was found, and the held-out recordings.
        base: the rig alone, fitted.
        start: the given rig.
        law: another friction law, where one was found.
        faults: of the recordings.
        options: of the diagnosis.
    """
    found = unseen.found
    final, setting = found.final, found.setting
    changed = changes(setting, final, start, seed=options.seed)
    recordings = [s.recording for s in setting.samples]
    told = gives_scale(recordings, options.fixed) or tells_scale(recordings)
    scale = 0.0 if told else options.doubt
    effects = named_effects(found, law, faults, scale)
    shaped = [t for t in (*final.terms, found.residual_shape) if t is not None and not is_named(t)]
    verdict = _verdict(found, effects, bool(shaped), changed, options)
    inside = [t.id for t in final.terms]
    # Another law and faults of the recordings are no candidates of the search.
    leading = next((e.id for e in effects if e.id in inside), shaped[0].id if shaped else "")
    known = {*inside, *(e.id for e in effects)}
    alternatives = [
        Alternative(*rival)
        for rival in rivals(found, leading, known)
        # What no candidate accounts for is not confused with those that were given up.
        if found.residual_shape is None or effects or rival[0] in found.rejected
    ]
    # The menu is of the rig's voltages.
    plays = setting.samples[0].recording.drive == "voltage"
    experiment = next_experiment(found) if final.terms and plays else None
    result = DiagnosisResult(
        verdict, _located(found, effects, shaped, verdict), effects, alternatives,
        describe(shaped[0]) if shaped else None, changed,
        _fit(unseen, base),
        final.noise.named(velocities=any(s.angles.shape[1] > 2 for s in setting.samples)),
        [f.text for f in faults], [], experiment,
        {
            "fit": [s.recording.source for s in setting.samples],
            "holdout": [s.recording.source for s in unseen.samples],
        },
    )  # fmt: skip
    if found.repetition is not None:
        result = with_repetition(result, found.repetition, found.final.rig.km)
    looked = bool(found.rounds) or found.refuted is not None
    return replace(result, sentences=sentences(result, found.rejected, found.reason, looked=looked))


def _verdict(
    found: Found, effects: list[NamedEffect], shaped: bool, changed: dict[str, Change],
    options: DiagnosisOptions,
) -> Verdict:  # fmt: skip
    if shaped:
        return "unexplained"
    if effects:
        return "missing_physics"
    # What is in the final fit is missing from the rig, though none of it may be called by a name.
    if found.refuted is not None or found.final.terms or not found.follows:
        return "unexplained"
    if options.given_rig and significant(changed):
        return "parameters"
    return "consistent"


def _located(
    found: Found, effects: list[NamedEffect], shaped: list[Term], verdict: Verdict
) -> Located | None:
    """Where what leads acts; a name that was given up tells at least where the mismatch sits."""
    fit = found.final
    if not found.follows:
        return None
    if found.residual_shape is not None:
        return locate(found.setting, fit, found.residual_shape)
    if not fit.terms and found.refuted is not None:
        fit = found.refuted
    if not fit.terms:
        return _law_located(effects)
    leading = min(fit.terms, key=lambda t: not is_parameter(t.id))
    return locate(found.setting, fit, shaped[0] if shaped and verdict == "unexplained" else leading)


def _law_located(effects: list[NamedEffect]) -> Located | None:
    if not effects:
        return None
    first = effects[0]
    depends = {"friction_shape": "omega_l"}.get(first.id, "time")
    equation = "lower" if first.id == "friction_shape" else "both"
    return Located(
        first.component, equation, depends, "", [], {}, None, None,
        {"upper": 0.0, "lower": 0.0}, {"upper": 0.0, "lower": 0.0},
    )  # fmt: skip


def _fit(unseen: Unseen, base: Fit) -> dict:
    found, before, after = unseen.found, unseen.before, unseen.after
    out: dict = {
        "fitted": {
            "log_likelihood": {"before": -0.5 * base.value, "after": -0.5 * found.final.value},
            "criterion_gain": base.bic - found.final.bic,
            "needed": BELIEVED,
        }
    }
    if found.explained < 1.0:
        out["explained"] = found.explained
    if not found.follows:
        out["follows"] = False
    if found.residual_torque is not None:
        left = zip(
            ("upper", "lower"),
            found.residual_torque.sizes,
            found.residual_torque.shares,
            strict=True,
        )
        out["residual_torque"] = {
            disc: {"rms_Nm": size, "predictable": part} for disc, size, part in left
        }
    if not unseen.samples:
        return out
    channels = judged_channels(unseen.samples[0])
    floor = noise_floor(unseen.drawn, found.final.noise, channels)
    for key, which in (("holdout", "free"), ("five_second_prediction", "short")):
        out[key] = {
            name: {
                "before_rms": _plain(rms(before, which, i)),
                "after_rms": _plain(rms(after, which, i)),
                "floor_rms": _plain(floor[which][name]),
            }
            for i, name in enumerate(channels)
            if any(np.isfinite(j.measured[:, i]).any() for j in before)
        }
    out["holdout"]["log_likelihood"] = {
        "before": -0.5 * sum(j.value for j in before),
        "after": -0.5 * sum(j.value for j in after),
        "floor": -0.5 * sum(j.floor for j in after),
    }
    return out


def _plain(value: float) -> float | None:
    return value if math.isfinite(value) else None
