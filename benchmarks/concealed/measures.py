"""Measures over the marks of many cases: the issue's table."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

Row = dict[str, Any]
_BINS = 10
# Sets of outcomes that are drawn from the claims.
_DRAWS = 2000


def wilson(hits: int, n: int) -> tuple[float, float]:
    """95 % interval of a share."""
    if n == 0:
        return 0.0, 1.0
    z, p = 1.959964, hits / n
    middle, half = p + z * z / (2 * n), z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    low, high = (middle - half) / (1 + z * z / n), (middle + half) / (1 + z * z / n)
    return max(low, 0.0), min(high, 1.0)


def share(rows: Sequence[Row], hit: Callable[[Row], bool]) -> Row:
    """How many rows hit, with the Wilson interval; the share is None of no rows."""
    hits = sum(bool(hit(r)) for r in rows)
    low, high = wilson(hits, len(rows))
    return {"hits": hits, "n": len(rows), "share": hits / len(rows) if rows else None,
            "low": low, "high": high}  # fmt: skip


def measure(rows: Sequence[Row]) -> dict[str, Any]:
    """Every measure of the issue that single runs can tell."""
    single = [r for r in rows if r["kind"] == "single" and r["identifiable"]]
    clear = [r for r in single if r["ratio"] >= 5]
    fair = [r for r in single if r["ratio"] == 2]
    faint = [r for r in single if r["ratio"] == 1]
    null = [r for r in rows if r["kind"] == "null"]
    pair = [r for r in rows if r["kind"] == "pair"]
    out = [r for r in rows if r["kind"] == "out"]
    shape = [r for r in rows if r["kind"] == "shape"]
    differ = [r for r in rows if r["kind"] == "differ" and r["identifiable"]]
    return {
        "named first, 5 x and more": share(clear, lambda r: r["first"]),
        "named first, 2 x": share(fair, lambda r: r["first"]),
        "named first, 1 x": share(faint, lambda r: r["first"]),
        "among the first three, 5 x and more": share(clear, lambda r: r["three"]),
        "component right, 5 x and more": share(clear, lambda r: r["component"]),
        "a second, wrong effect too, 5 x and more": share(clear, lambda r: r["surplus"] > 0),
        "among the first three, 2 x": share(fair, lambda r: r["three"]),
        "component right, 2 x": share(fair, lambda r: r["component"]),
        "a second, wrong effect too, 2 x": share(fair, lambda r: r["surplus"] > 0),
        "named first, not identifiable": share(
            [r for r in rows if r["kind"] == "single" and not r["identifiable"]],
            lambda r: r["first"],
        ),
        "false alarms on nulls": share(null, lambda r: r["alarm"] or not r["diagnosed"]),
        "false alarms on nasty nulls": share(
            [r for r in null if r["nasty"]], lambda r: r["alarm"] or not r["diagnosed"]
        ),
        "pairs: both": share(pair, lambda r: r["both"]),
        "pairs: at least one": share(pair, lambda r: r["one"]),
        "friction shape named first": share(shape, lambda r: r["first"]),
        "out of library: says so": share(out, lambda r: r["says_unexplained"]),
        "out of library: coordinate right": share(out, lambda r: r["coordinate"]),
        "law differs: a sibling named first": share(differ, lambda r: r["first"]),
        "law differs: component right": share(differ, lambda r: r["component"]),
        "law differs: told as unexplained": share(differ, lambda r: r["says_unexplained"]),
        "law differs: a second, wrong effect too": share(differ, lambda r: r["surplus"] > 0),
        "coverage of 95 % intervals": share(
            [c for r in rows for c in r["covered"]], lambda c: c["inside"]
        ),
        "expected calibration error": calibration_error(rows),
        "held-out gap closed, truth refitted": _gap(
            [r for r in clear + pair if r["refitted"]], "gap_closed"
        ),
        "held-out gap closed": _gap(clear + pair, "gap_closed"),
        "held-out gap closed, against the true plant from its true states": _gap(
            clear + pair, "gap_closed_true_plant"
        ),
        "predictable of what is left, nothing missing and told so": _left(
            [r for r in null if not r["alarm"]]
        ),
        "predictable of what is left, named first": _left([r for r in rows if r["first"]]),
        "CPU s a case": _quantiles([r["cpu_s"] for r in rows if r["cpu_s"] is not None]),
        "s by the clock a case": _quantiles([r["wall_s"] for r in rows if r["wall_s"] is not None]),
        "effects": by_effect(rows),
    }


def calibration_error(rows: Sequence[Row]) -> Row:
    """Mean distance of claimed probability from the share of right claims, in ten bins.

    Each case whose first effect has a probability counts, a null that names one as wrong. A bin
    that holds few claims is off though they are calibrated: how far the error is then is drawn from
    the claims themselves (Broecker and Smith, Weather and Forecasting 22, 2007).
    """
    claims = [(r["probability"], r["first"]) for r in rows if r["probability"] is not None]
    if not claims:
        return {"error": None, "n": 0, "bins": []}
    claimed, right = np.array(claims, dtype=float).T
    places = np.minimum((claimed * _BINS).astype(int), _BINS - 1)
    inside = places[:, np.newaxis] == np.unique(places)
    count = inside.sum(axis=0)
    drawn = np.random.default_rng(0).random((_DRAWS, len(claims))) < claimed
    off = np.abs((np.vstack([right, drawn]) - claimed) @ inside).sum(axis=1) / len(claims)
    error, *chance = off.tolist()
    rates = zip(claimed @ inside / count, right @ inside / count, count, strict=True)
    return {
        "error": error, "n": len(claims),
        "bins": [{"claimed": float(c), "right": float(r), "n": int(n)} for c, r, n in rates],
        "if_calibrated": float(np.mean(chance)),
        "if_calibrated_95": float(np.quantile(chance, 0.95)),
    }  # fmt: skip


def _left(rows: Sequence[Row]) -> Row:
    return _quantiles([v for r in rows if (v := r.get("left_predictable")) is not None])


def _gap(rows: Sequence[Row], name: str) -> Row:
    known = [r for r in rows if r[name] is not None]
    refitted = sum(r["refitted"] for r in known) if name == "gap_closed" else 0
    return {**_quantiles([r[name] for r in known]), "refitted": refitted}


def _quantiles(values: Sequence[float]) -> Row:
    if not values:
        return {"n": 0, "median": None, "tenth": None, "ninetieth": None, "largest": None}
    tenth, median, ninetieth = np.quantile(values, [0.1, 0.5, 0.9]).tolist()
    return {"n": len(values), "median": median, "tenth": tenth, "ninetieth": ninetieth,
            "largest": max(values)}  # fmt: skip


def by_effect(rows: Sequence[Row]) -> dict[str, Row]:
    """Effect by effect: how often it was named at each ratio, and what was named instead."""
    found: dict[str, Row] = {}
    for r in rows:
        if r["kind"] not in ("single", "shape", "differ"):
            continue
        entry = found.setdefault(
            r["effects"][0],
            {"identifiable": r["identifiable"], "first": {}, "three": {}, "instead": {}},
        )
        ratio = f"{r['ratio']:g}"
        for name in ("first", "three"):
            hits, n = entry[name].get(ratio, (0, 0))
            entry[name][ratio] = (hits + bool(r[name]), n + 1)
        if not r["first"]:
            said = r["said"][0][0] if r["said"] else str(r["verdict"])
            entry["instead"][said] = entry["instead"].get(said, 0) + 1
    return dict(sorted(found.items()))
