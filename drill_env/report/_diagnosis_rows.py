"""The tables of a diagnosis's page, as text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from drill_env.diagnosis.intervals import significant
from drill_env.diagnosis.probability import UNLISTED, probability_in
from drill_env.diagnosis.result import DiagnosisResult, Number, digits_of
from drill_env.diagnosis.rounds import Found, Round
from drill_env.diagnosis.terms import Shape, Term
from drill_env.effects import LIBRARY
from drill_env.parameters import Rig

CHANNELS = ("theta_u", "omega_u", "theta_l", "omega_l")
_MOST_ROWS = 8
_NOTHING = "nothing"


def number_text(value: float | None, digits: int = 4) -> str:
    """A number, or a dash for none."""
    return "–" if value is None else f"{value:.{digits}g}"


def _between(low: float, high: float) -> str:
    digits = digits_of(low, low, high)
    return f"{low:.{digits}g} … {high:.{digits}g}"


def _words(name: str) -> str:
    return name.replace("_", " ")


def names_of(result: DiagnosisResult) -> str:
    """What was found, in a few words."""
    if result.shape is not None:
        return f"a {result.shape.sort} that depends on {result.shape.coordinate}"
    return " and ".join(_words(effect.id) for effect in result.effects)


def located_rows(result: DiagnosisResult) -> list[tuple[str, str]]:
    """Where it sits, as names and values."""
    where = result.located
    if where is None:
        return []
    rows = [
        ("component", where.component),
        (
            "equation of motion",
            {"both": "both discs"}.get(where.equation, f"{where.equation} disc"),
        ),
        ("depends on", where.depends_on),
    ]
    if where.angle_order is not None:
        rows.append(("cycles a turn", number_text(where.angle_order)))
    if where.frequency_hz is not None:
        rows.append(("frequency", f"{number_text(where.frequency_hz)} Hz"))
    rows += [(f"strong at {k}", _between(*v[:2])) for k, v in where.region.items()]
    for disc in ("upper", "lower"):
        torque, angle = where.excess_torque_rms_Nm[disc], where.excess_angle_rms_rad[disc]
        if torque:
            rows.append((f"torque on the {disc} disc", f"{number_text(torque, 3)} Nm rms"))
        if angle:
            rows.append((f"misreading of the {disc} encoder", f"{number_text(angle, 3)} rad rms"))
    return rows


def effect_rows(numbers: Mapping[str, Number]) -> list[dict[str, str]]:
    """An effect's numbers with their intervals."""
    return [
        {
            "name": name,
            "value": number_text(n.value, digits_of(n.value, n.low, n.high)),
            "between": _between(n.low, n.high),
            "unit": "" if n.unit == "1" else n.unit,
        }
        for name, n in numbers.items()
    ]


def ranking_rows(found: Round, of: Found) -> list[dict[str, Any]]:
    """Candidates of one round of a search, most probable first, rejected ones last."""
    names, rejected = {term.id for term in of.final.terms}, of.rejected
    nothing = 0.0 if found.weights else 1.0 - UNLISTED
    rows = [{"id": _NOTHING, "what": "the model as it is", "chance": nothing, "gain": ""}]
    for attempt in (*found.named, *found.shapes):
        row = {
            "id": attempt.term.id,
            "what": _meaning(attempt.term),
            "chance": probability_in(found, attempt.term.id),
        }
        if row["id"] in rejected:
            row["what"] += f" Rejected: {of.reason}."
        rows.append({**row, "gain": f"{attempt.criterion:.0f}"})
    rows.sort(key=lambda row: -row["chance"])
    given = [row for row in rows if row["id"] in rejected]
    best = [row for row in rows if row not in given][: _MOST_ROWS - len(given)] + given
    for row in best:
        row["percent"] = f"{100 * row['chance']:.1f}"
        row["kept"] = row["id"] in names
    return best


def _meaning(term: Term) -> str:
    if term.id in LIBRARY:
        return LIBRARY[term.id].meaning
    if isinstance(term.source, Shape):
        return f"a free {term.source.sort} over {term.source.depends_on}"
    return term.source.effect.meaning


def error_rows(result: DiagnosisResult) -> list[dict[str, str]]:
    """Errors on held-out recordings, before and after."""
    rows = []
    for key, what in (("five_second_prediction", "5 s prediction"), ("holdout", "free run")):
        for name in CHANNELS:
            errors = result.fit.get(key, {}).get(name)
            if errors is None:
                continue
            before, after, floor = (errors[k] for k in ("before_rms", "after_rms", "floor_rms"))
            row = {"what": what, "channel": name, "closed": _closed(before, after, floor)}
            rows.append(
                row | {"before": number_text(before, 3), "after": number_text(after, 3),
                       "floor": number_text(floor, 3)}
            )  # fmt: skip
    return rows


def _closed(before: float | None, after: float | None, floor: float | None) -> str:
    """Share of what stood above the noise that is gone."""
    if before is None or after is None or floor is None or before <= 1.05 * floor:
        return "–"
    return f"{100 * min((before - after) / (before - floor), 1.0):.0f} %"


def likelihood_rows(result: DiagnosisResult) -> list[dict[str, str]]:
    """Log likelihoods before and after."""
    rows = []
    for key, what in (("fitted", "fitted recordings"), ("holdout", "held-out recordings")):
        values = result.fit.get(key, {}).get("log_likelihood")
        if values is not None:
            rows.append({"what": what, **{k: f"{v:.0f}" for k, v in values.items()}})
    return rows


def parameter_rows(result: DiagnosisResult) -> list[dict[str, Any]]:
    """Parameters of the rig before and after."""
    units = {item.name: item.metadata.get("unit", "") for item in fields(Rig)}
    units |= {f"{e.id}.{p.name}": p.unit for e in LIBRARY.values() for p in e.parameters}
    changed = result.parameters_changed
    moved = set(significant(changed))
    return [
        {
            "name": name,
            "before": number_text(c.before),
            "after": number_text(c.after, digits_of(c.after, c.low, c.high)),
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
    "speed_u": ("upper velocity", "rad/s"),
    "speed_l": ("lower velocity", "rad/s"),
}


def noise_rows(result: DiagnosisResult) -> list[dict[str, str]]:
    """Noise that is left."""
    return [
        {"what": what, "value": number_text(result.noise[key], 3), "unit": unit}
        for key, (what, unit) in _NOISE.items()
        if key in result.noise
    ]


def grade_rows(result: DiagnosisResult) -> list[dict[str, Any]]:
    """How finely the first finding can be told."""
    g = result.grades
    if g is None:
        return []
    rows = [
        ("component", g.component, g.component_probability),
        ("coordinate", g.depends_on, g.depends_on_probability),
    ]
    if g.family:
        rows.append(("family", g.family, g.family_probability))
    if g.law:
        rows.append(("law", g.law, g.law_probability))
    return [{"grade": a, "answer": b, "percent": round(100 * p)} for a, b, p in rows]


def prediction_rows(result: DiagnosisResult) -> list[list[dict[str, Any]]]:
    """The tables of candidates by their prediction of unseen recordings."""
    return [
        [
            {
                "id": row.id,
                "gain": f"{row.gain:.1f}",
                "error": f"{row.standard_error:.1f}",
                "z": f"{row.z:.1f}",
                "numbers": row.numbers,
                "percent": round(100 * row.weight) if row.weight > 0.0 else None,
                "kept": row.kept,
            }
            for row in table[:_MOST_ROWS]
        ]
        for table in result.predictions
    ]
