"""Marks of one case: a diagnosis held against its answer."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from benchmarks.concealed.terms import in_tool_terms

ALARMS = ("missing_physics", "unexplained")
# What is left of a gap is noise where the oracle itself is hardly better than the start.
_CLOSABLE = 1.1
_ANGLES = ("phase",)


def names_of(effect: Mapping[str, Any]) -> set[str]:
    """An effect's id and those that no recording can tell from it."""
    return {str(effect["id"]), *(str(name) for name in effect.get("alias_class") or [])}


def right_names(truth: Mapping[str, Any]) -> set[str]:
    """What a concealed effect may rightly be called: its id, or its siblings where it has any."""
    return set(truth.get("siblings") or [truth["id"]])


def ranked(diagnosis: Mapping[str, Any]) -> list[set[str]]:
    """Names in the order the diagnosis believes in them, the effects before the alternatives."""
    found: list[set[str]] = []
    for effect in [*(diagnosis.get("effects") or []), *(diagnosis.get("alternatives") or [])]:
        names = names_of(effect)
        if not any(names & other for other in found):
            found.append(names)
    return found


def mark(
    answer: Mapping[str, Any],
    diagnosis: Mapping[str, Any] | None,
    oracle: Mapping[str, float] | None = None,
) -> dict[str, Any]:
    """Everything that is measured on one case.

    Args:
        answer: as sealed.
        diagnosis: `diagnosis.json`; None where the tool gave none, which is always wrong.
        oracle: rms error of 5 s predictions by the true structure refitted, rad, by channel;
            the true plant from its true states by default.
    """
    truths = list(answer["effects"])
    marks: dict[str, Any] = {
        "kind": answer["kind"], "nasty": answer["nasty"],
        "effects": [t["id"] for t in truths],
        "ratio": truths[0].get("asked_ratio", truths[0]["ratio"]) if truths else 0.0,
        "identifiable": all(t["identifiable"] for t in truths), "diagnosed": diagnosis is not None,
    }  # fmt: skip
    diagnosis = diagnosis or {}
    order = ranked(diagnosis)
    believed = [names_of(e) for e in diagnosis.get("effects") or []]
    wanted = {name for t in truths for name in right_names(t)}
    hits = [any(names & right_names(t) for names in believed) for t in truths]
    located = diagnosis.get("located") or {}
    components = {t["component"] for t in truths}
    true_plant = _pooled(answer["oracle_five_second_rms"].values())
    marks |= {
        "verdict": diagnosis.get("verdict"),
        "said": [sorted(names) for names in believed],
        "first": bool(believed) and bool(believed[0] & wanted),
        "three": any(names & wanted for names in order[:3]),
        "component": located.get("component") in components,
        "alarm": diagnosis.get("verdict") in ALARMS,
        "both": bool(hits) and all(hits), "one": any(hits),
        "surplus": sum(not names & wanted for names in believed),
        "says_unexplained": diagnosis.get("verdict") == "unexplained",
        "coordinate": bool(truths) and _coordinate(diagnosis) in truths[0]["depends_on"],
        "probability": _probability(diagnosis),
        "gap_closed": _gap_closed(diagnosis, oracle or true_plant) if truths else None,
        "gap_closed_true_plant": _gap_closed(diagnosis, true_plant) if truths else None,
        "refitted": oracle is not None,
        "left_predictable": _left(diagnosis),
        "covered": list(_coverage(answer, diagnosis)),
    }  # fmt: skip
    return marks


def _coordinate(diagnosis: Mapping[str, Any]) -> Any:
    shape = diagnosis.get("shape") or {}
    if diagnosis.get("verdict") == "unexplained" and shape.get("coordinate"):
        # The maker's word for the same.
        return {"omega_u - omega_l": "twist_rate"}.get(shape["coordinate"], shape["coordinate"])
    return (diagnosis.get("located") or {}).get("depends_on")


def _probability(diagnosis: Mapping[str, Any]) -> float | None:
    effects = diagnosis.get("effects") or []
    return float(effects[0]["probability"]) if effects else None


def _left(diagnosis: Mapping[str, Any]) -> float | None:
    """The larger share of what is left over at either disc that the motion predicts."""
    left = (diagnosis.get("fit") or {}).get("residual_torque") or {}
    return max((float(part["predictable"]) for part in left.values()), default=None)


def _pooled(recordings: Iterable[Mapping[str, float]]) -> dict[str, float]:
    """Rms errors of recordings of one length taken together."""
    found = list(recordings)
    return {
        channel: math.sqrt(sum(one[channel] ** 2 for one in found) / len(found))
        for channel in ("theta_u", "theta_l")
    }


def _gap_closed(diagnosis: Mapping[str, Any], oracle: Mapping[str, float]) -> float | None:
    """Share of the closable error of 5 s predictions that is closed, mean over the channels."""
    if not diagnosis:
        return 0.0
    five = (diagnosis.get("fit") or {}).get("five_second_prediction") or {}
    shares = []
    for channel, least in oracle.items():
        told = five.get(channel) or {}
        before, after = told.get("before_rms"), told.get("after_rms")
        if before is None or before <= _CLOSABLE * least:
            continue
        # Predictions that leave all bounds close nothing.
        shares.append(min((before - after) / (before - least), 1.0) if after is not None else 0.0)
    return sum(shares) / len(shares) if shares else None


def _coverage(answer: Mapping[str, Any], diagnosis: Mapping[str, Any]) -> Iterable[dict[str, Any]]:
    """Whether each interval holds the true value in the tool's own terms, where there is one."""
    for truth in answer["effects"]:
        values = in_tool_terms(truth["id"], truth["parameters"], answer["rig"], answer["counts"])
        for effect in diagnosis.get("effects") or []:
            told = effect.get("parameters") or {}
            if effect["id"] != truth["id"]:
                continue
            for name, value in values.items():
                found = told.get(name)
                if found is not None and found.get("low") is not None:
                    yield {"parameter": f"{truth['id']}.{name}", "true": value, "inside": _inside(
                        name, value, found["low"], found["high"])}  # fmt: skip


def _inside(name: str, value: float, low: float, high: float) -> bool:
    if name in _ANGLES:
        value = low + (value - low) % (2.0 * math.pi)
    return low <= value <= high
