"""A diagnosis as one page that a lab engineer reads without help."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader

from drill_env._types import FloatArray
from drill_env.diagnosis.belief import probabilities, significant
from drill_env.diagnosis.diagnose import Diagnosis
from drill_env.diagnosis.result import DiagnosisResult, Number
from drill_env.diagnosis.search import NEEDED, Round
from drill_env.diagnosis.terms import Named, Term
from drill_env.report.diagnosis_evidence import Evidence, evidence, latent_torques
from drill_env.report.diagnosis_figures import (
    errors_figure,
    held_out_figure,
    law_figure,
    recording_figure,
)
from drill_env.report.diagnosis_friction import friction_figure

_VERDICTS = {
    "consistent": ("good", "Nothing is missing"),
    "parameters": ("note", "Parameters differ, nothing is missing"),
    "missing_physics": ("bad", "Physics is missing from the model"),
    "unexplained": ("bad", "Something is missing that has no name"),
}
_ANGLES = ("theta_u", "theta_l")
_MOST_RECORDINGS, _MOST_ROWS = 4, 8
_NOTHING, _LAW = "nothing", "friction_shape"


def diagnosis_page(found: Diagnosis) -> str:
    """The page, one file that needs no network.

    Args:
        found: from `drill_env.diagnosis.diagnose.diagnose`.
    """
    page = Environment(
        loader=PackageLoader("drill_env.report", "templates"), autoescape=True,
        trim_blocks=True, lstrip_blocks=True,
    ).get_template("diagnosis.html")  # fmt: skip
    result, final = found.result, found.found.final
    left = latent_torques(found.found, final.terms)
    seen = [evidence(found.found, term, left) for term in final.terms]
    tone, title = _VERDICTS[result.verdict]
    return page.render(
        result=result, tone=tone, title=title, names=_names(result),
        located=_located_rows(result), recordings=_recordings(found, left, seen),
        laws=[{"id": e.term.id, "figure": law_figure(e, i), "seen": e} for i, e in enumerate(seen)],
        friction=friction_figure(found.found, found.start, left) if final.rig.inertias == 2 else "",
        new_law=any(effect.id == _LAW for effect in result.effects),
        effects=[_effect(e.parameters) for e in result.effects],
        rounds=[_ranking(r, final.terms) for r in found.found.rounds], needed=_number(NEEDED),
        errors=_errors(result), likelihoods=_likelihoods(result), held=_held_out(found),
        parameters=_parameters(found), noise=_noise(result), most=_MOST_RECORDINGS,
    )  # fmt: skip


def _number(value: float | None, digits: int = 4) -> str:
    return "–" if value is None else f"{value:.{digits}g}"


def _between(low: float, high: float) -> str:
    return f"{low:.4g} … {high:.4g}"


def _words(name: str) -> str:
    return name.replace("_", " ")


def _names(result: DiagnosisResult) -> str:
    if result.shape is not None:
        return f"a {result.shape.sort} that depends on {result.shape.coordinate}"
    return " and ".join(_words(effect.id) for effect in result.effects)


def _located_rows(result: DiagnosisResult) -> list[tuple[str, str]]:
    where = result.located
    if where is None:
        return []
    rows = [
        ("component", where.component),
        ("equation of motion", {"both": "both discs"}.get(where.equation, f"{where.equation} disc")),
        ("depends on", where.depends_on),
    ]
    if where.angle_order is not None:
        rows.append(("cycles a turn", _number(where.angle_order)))
    if where.frequency_hz is not None:
        rows.append(("frequency", f"{_number(where.frequency_hz)} Hz"))
    rows += [(f"strong at {k}", _between(*v[:2])) for k, v in where.region.items()]
    for disc in ("upper", "lower"):
        torque, angle = where.excess_torque_rms_Nm[disc], where.excess_angle_rms_rad[disc]
        if torque:
            rows.append((f"torque on the {disc} disc", f"{_number(torque, 3)} Nm rms"))
        if angle:
            rows.append((f"misreading of the {disc} encoder", f"{_number(angle, 3)} rad rms"))
    return rows


def _recordings(
    found: Diagnosis, left: tuple[FloatArray, ...], seen: list[Evidence]
) -> list[dict[str, Any]]:
    where, fit = found.result.located, found.found.final
    rows = []
    for i, samples in enumerate(found.found.setting.samples[:_MOST_RECORDINGS]):
        name = Path(samples.recording.source).name
        shaded = where.intervals_s if where is not None and where.recording == name else []
        figure = recording_figure(
            fit.motions[i], left[i], seen[0] if seen else None, i, shaded,
            inertias=fit.rig.inertias,
        )  # fmt: skip
        rows.append({"name": name, "figure": figure, "shaded": len(shaded)})
    return rows


def _effect(numbers: Mapping[str, Number]) -> list[dict[str, str]]:
    return [
        {
            "name": name,
            "value": _number(n.value),
            "between": _between(n.low, n.high),
            "unit": "" if n.unit == "1" else n.unit,
        }
        for name, n in numbers.items()
    ]


def _ranking(found: Round, kept: tuple[Term, ...]) -> list[dict[str, Any]]:
    """Candidates of one search, most probable first."""
    chances = probabilities(found)
    names = {term.id for term in kept}
    rows = [{"id": _NOTHING, "what": "the model as it is", "chance": chances["none"], "gain": ""}]
    for attempt in (*found.named, *found.shapes):
        source = attempt.term.source
        what = (
            source.effect.meaning
            if isinstance(source, Named)
            else f"a free {source.sort} over {source.depends_on}"
        )
        row = {"id": attempt.term.id, "what": what, "chance": chances[attempt.term.id]}
        rows.append({**row, "gain": f"{attempt.criterion:.0f}"})
    best = sorted(rows, key=lambda row: -row["chance"])[:_MOST_ROWS]
    for row in best:
        row["percent"] = f"{100 * row['chance']:.1f}"
        row["kept"] = row["id"] in names
    return best


def _errors(result: DiagnosisResult) -> list[dict[str, str]]:
    rows = []
    for key, what in (("five_second_prediction", "5 s prediction"), ("holdout", "free run")):
        for name in _ANGLES:
            errors = result.fit.get(key, {}).get(name)
            if errors is None:
                continue
            before, after, floor = (errors[k] for k in ("before_rms", "after_rms", "floor_rms"))
            row = {"what": what, "channel": name, "closed": _closed(before, after, floor)}
            rows.append(
                row | {"before": _number(before, 3), "after": _number(after, 3),
                       "floor": _number(floor, 3)}
            )  # fmt: skip
    return rows


def _closed(before: float | None, after: float | None, floor: float | None) -> str:
    """Share of what stood above the noise that is gone."""
    if before is None or after is None or floor is None or before <= 1.05 * floor:
        return "–"
    return f"{100 * min((before - after) / (before - floor), 1.0):.0f} %"


def _likelihoods(result: DiagnosisResult) -> list[dict[str, str]]:
    rows = []
    for key, what in (("fitted", "fitted recordings"), ("holdout", "held-out recordings")):
        values = result.fit.get(key, {}).get("log_likelihood")
        if values is not None:
            rows.append({"what": what, **{k: f"{v:.0f}" for k, v in values.items()}})
    return rows


def _held_out(found: Diagnosis) -> list[dict[str, Any]]:
    short = found.result.fit.get("five_second_prediction", {})
    floors = [short.get(name, {}).get("floor_rms") for name in _ANGLES]
    pairs = zip(found.holdout, found.before, found.after, strict=True)
    return [
        {
            "name": Path(source).name,
            "motion": held_out_figure(before, after, i),
            "errors": errors_figure(before, after, floors, i),
        }
        for i, (source, before, after) in enumerate(pairs)
        if i < _MOST_RECORDINGS
    ]


def _parameters(found: Diagnosis) -> list[dict[str, Any]]:
    units = {item.name: item.metadata.get("unit", "") for item in fields(found.start)}
    changed = found.result.parameters_changed
    moved = set(significant(changed))
    return [
        {
            "name": name,
            "before": _number(c.before),
            "after": _number(c.after),
            "between": _between(c.low, c.high),
            "unit": units.get(name, ""),
            "moved": name in moved,
        }
        for name, c in changed.items()
    ]


_NOISE = {
    "torque_u": ("torque on the upper disc", "Nm"),
    "torque_l": ("torque on the lower disc", "Nm"),
    "tau_u": ("correlation time of the upper torque", "s"),
    "tau_l": ("correlation time of the lower torque", "s"),
    "encoder_u": ("upper encoder", "rad"),
    "encoder_l": ("lower encoder", "rad"),
}


def _noise(result: DiagnosisResult) -> list[dict[str, str]]:
    return [
        {"what": what, "value": _number(result.noise[key], 3), "unit": unit}
        for key, (what, unit) in _NOISE.items()
        if key in result.noise
    ]
