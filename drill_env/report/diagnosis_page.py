"""A diagnosis as one page that a lab engineer reads without help."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader

from drill_env._types import FloatArray
from drill_env.diagnosis.by_prediction import PredictionDiagnosis
from drill_env.diagnosis.diagnose import Diagnosis
from drill_env.diagnosis.locate import label_of
from drill_env.diagnosis.lost_counts import LostCounts
from drill_env.diagnosis.probability import CONFUSED
from drill_env.diagnosis.strikes import Strike
from drill_env.report._diagnosis_rows import (
    effect_rows,
    error_rows,
    grade_rows,
    likelihood_rows,
    located_rows,
    names_of,
    noise_rows,
    parameter_rows,
    prediction_rows,
    ranking_rows,
)
from drill_env.report.diagnosis_evidence import Evidence, evidence, latent_torques
from drill_env.report.diagnosis_figures import (
    errors_figure,
    held_out_figure,
    law_figure,
    recording_figure,
)
from drill_env.report.diagnosis_friction import friction_figure
from drill_env.report.prediction_page import VERDICTS, prediction_page

_MOST_RECORDINGS = 4
_LAW = "friction_shape"


def diagnosis_page(found: Diagnosis | PredictionDiagnosis) -> str:
    """The page, one file that needs no network.

    Args:
        found: from `drill_env.diagnosis.diagnose.diagnose`.
    """
    if isinstance(found, PredictionDiagnosis):
        return prediction_page(found)
    page = Environment(
        loader=PackageLoader("drill_env.report", "templates"), autoescape=True,
        trim_blocks=True, lstrip_blocks=True,
    ).get_template("diagnosis.html")  # fmt: skip
    result, final = found.result, found.found.final
    left = latent_torques(found.found, final.terms)
    seen = [evidence(found.found, term, left) for term in final.terms]
    tone, title = VERDICTS[result.verdict]
    return page.render(
        result=result, tone=tone, title=title, names=names_of(result),
        located=located_rows(result), recordings=_recordings(found, left, seen),
        laws=_laws(seen), leading=("error" if seen[0].senses else "torque") if seen else "",
        friction=friction_figure(found.found, found.start, left) if final.rig.inertias == 2 else "",
        new_law=any(effect.id == _LAW for effect in result.effects),
        effects=[effect_rows(e.parameters) for e in result.effects],
        rounds=[ranking_rows(r, found.found) for r in found.found.rounds],
        predictions=prediction_rows(result), grades=grade_rows(result),
        errors=error_rows(result), likelihoods=likelihood_rows(result), held=_held_out(found),
        added=bool(seen),
        open=[a.id for a in result.alternatives if a.probability >= CONFUSED],
        parameters=parameter_rows(result), noise=noise_rows(result), most=_MOST_RECORDINGS,
    )  # fmt: skip


def _laws(seen: list[Evidence]) -> list[dict[str, Any]]:
    # What happened at single moments is a function of no coordinate.
    lasting = [e for e in seen if not isinstance(e.term.source, (LostCounts, Strike))]
    return [
        {"id": e.term.id, "figure": law_figure(e, i), "senses": e.senses}
        for i, e in enumerate(lasting)
    ]


def _recordings(
    found: Diagnosis, left: tuple[FloatArray, ...], seen: list[Evidence]
) -> list[dict[str, Any]]:
    where, fit = found.result.located, found.found.final
    rows = []
    for i in range(len(found.found.setting.samples[:_MOST_RECORDINGS])):
        name = label_of(found.found.setting, i)
        shaded = where.intervals_s if where is not None and where.recording == name else []
        figure = recording_figure(
            fit.motions[i], left[i], seen[0] if seen else None, i, shaded,
            inertias=fit.rig.inertias,
        )  # fmt: skip
        rows.append({"name": name, "figure": figure, "shaded": len(shaded)})
    return rows


def _held_out(found: Diagnosis) -> list[dict[str, Any]]:
    short = found.result.fit.get("five_second_prediction", {})
    pairs = zip(found.holdout, found.before, found.after, strict=True)
    return [
        {
            "name": Path(source).name,
            "motion": held_out_figure(before, after, i),
            "errors": errors_figure(
                before, after, [short.get(n, {}).get("floor_rms") for n in after.channels], i
            ),
        }
        for i, (source, before, after) in enumerate(pairs)
        if i < _MOST_RECORDINGS
    ]
