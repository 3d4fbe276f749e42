"""The measures as Markdown tables."""

from __future__ import annotations

from typing import Any

BARS = {
    "named first, 5 x and more": "95 % and more",
    "named first, 2 x": "75 % and more",
    "among the first three, 5 x and more": "99 % and more",
    "component right, 5 x and more": "98 % and more",
    "false alarms on nulls": "2 % and less",
    "pairs: both": "80 % and more",
    "pairs: at least one": "98 % and more",
    "out of library: says so": "85 % and more",
    "out of library: coordinate right": "90 % and more",
    "law differs: a sibling named first": "85 % and more",
    "coverage of 95 % intervals": "92 to 98 %",
    "expected calibration error": "0.05 and less",
    "held-out gap closed, truth refitted": "median 0.98, 10th percentile 0.85 and more",
    "CPU s a case": "30 and less",
}


def _value(entry: dict[str, Any]) -> str:
    if "hits" in entry:
        if not entry["n"]:
            return "no case"
        return (
            f"{entry['hits']}/{entry['n']} = {entry['share']:.1%} "
            f"({entry['low']:.1%} to {entry['high']:.1%})"
        )
    if "error" in entry:
        if entry["error"] is None:
            return "no case"
        return (
            f"{entry['error']:.3f} over {entry['n']}; calibrated, {entry['if_calibrated']:.3f} "
            f"in the mean, one time in twenty above {entry['if_calibrated_95']:.3f}"
        )
    if not entry["n"]:
        return "no case"
    refitted = f", {entry['refitted']} of them refitted" if entry.get("refitted") else ""
    return (
        f"median {entry['median']:.3g}, 10th percentile {entry['tenth']:.3g}, 90th "
        f"{entry['ninetieth']:.3g}, largest {entry['largest']:.3g} over {entry['n']}{refitted}"
    )


def _counts(entry: dict[str, Any], name: str, ratio: str) -> str:
    hits, n = entry[name].get(ratio, (0, 0))
    return f"{hits}/{n}" if n else ""


def markdown(found: dict[str, Any]) -> str:
    """Both tables of a score, shares with their Wilson 95 % intervals."""
    measures = dict(found["measures"])
    effects = measures.pop("effects")
    lines = [f"{len(found['cases'])} cases.", "", "| measure | value | bar |", "|---|---|---|"]
    lines += [f"| {n} | {_value(entry)} | {BARS.get(n, '')} |" for n, entry in measures.items()]
    ratios = sorted({r for e in effects.values() for r in e["first"]}, key=float)
    heads = [f"{name} at {r} x" for r in ratios for name in ("first", "three")]
    lines += ["", f"| effect | {' | '.join(heads)} | named instead |"]
    lines.append("|---" * (len(heads) + 2) + "|")
    for name, entry in effects.items():
        cells = [_counts(entry, kind, r) for r in ratios for kind in ("first", "three")]
        instead = ", ".join(f"{n} {k}" for k, n in entry["instead"].items())
        hard = "" if entry["identifiable"] else " (not identifiable)"
        lines.append(f"| {name}{hard} | {' | '.join(cells)} | {instead} |")
    if found["faults"]:
        lines += ["", "Without a diagnosis:", ""]
        lines += [f"- {case}: {why}" for case, why in sorted(found["faults"].items())]
    return "\n".join(lines) + "\n"
