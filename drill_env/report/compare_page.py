"""The protocol's results as one page: ranking, curves over the open loop, heat maps, traces."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from jinja2 import Environment, PackageLoader
from jinja2.utils import htmlsafe_json_dumps
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from drill_env._files import write_text
from drill_env.benchmark import open_loop_diagram
from drill_env.benchmark.protocol import Cell, Protocol
from drill_env.benchmark.summary import ranking
from drill_env.parameters import Rig

_GRID_POINTS = 91
_LARGE_SPEED = 40.0
_TIER_NAMES = {"E": "Tier E: both encoders", "S": "Tier S: upper encoder alone"}


def save_compare_page(
    whole: pd.DataFrame,
    points: pd.DataFrame,
    facts: pd.DataFrame,
    files: Mapping[Cell, Path],
    protocol: Protocol,
    path: Path,
) -> None:
    """Write the interactive page, one file that needs no network.

    Args:
        whole: one row a cell, of `drill_env.benchmark.summary.read_cells`.
        points: one row a cell and set point, likewise.
        facts: linear design facts, with a column controller; may be empty.
        files: table of every cell, its traces beside it.
        protocol: what was run.
        path: of the page.
    """
    order = ranking(whole, protocol)
    told = whole[~whole.ranked].controller.unique().tolist()
    data = {
        "setpoints": list(protocol.setpoints), "levels": list(protocol.levels),
        "starts": list(protocol.starts), "limit": protocol.config.voltage_limit,
        "controllers": [*order.controller, *told], "points": _points(points),
        "loop": _open_loop(protocol.config.rig, protocol), "traces": _traces(files),
    }  # fmt: skip
    page = Environment(
        loader=PackageLoader("drill_env.report", "templates"), autoescape=True
    ).get_template("compare.html")
    text = page.render(
        plotly=Markup(get_plotlyjs()),
        data=htmlsafe_json_dumps(_plain(data), separators=(",", ":")),
        protocol=protocol, tiers=[_tier(order, tier) for tier in ("E", "S")], told=told,
        facts=_facts_table(facts), start=protocol.main_start.replace("_", " "),
    )  # fmt: skip
    write_text(path, text)


def _tier(order: pd.DataFrame, tier: str) -> dict[str, Any]:
    rows = order[order.tier == tier]
    levels = [name for name in ("L0", "L1", "L2", "L3") if name in rows]
    body = [
        [
            str(row["rank"]), row["controller"], f"{row['mean_share']:.3f}",
            *(_share(row, level) for level in levels),
        ]
        for row in rows.to_dict("records")
    ]  # fmt: skip
    return {"name": _TIER_NAMES[tier], "levels": levels, "rows": body}


def _share(row: Mapping[str, Any], level: str) -> Markup:
    time = row[f"{level}_t50_s"]
    settled = f"{time:.1f} s" if math.isfinite(time) else "never"
    return Markup("<b>{:.3f}</b> <small>{}<br>{:.3f} to {:.3f}</small>").format(
        row[level], settled, row[f"{level}_low"], row[f"{level}_high"]
    )


def _points(points: pd.DataFrame) -> dict[str, Any]:
    names = {
        "min": "min", "max": "max", "mean": "mean", "low": "median_min", "high": "median_max",
        "free": "vibration_free_share",
    }  # fmt: skip
    found: dict[str, Any] = {}
    for (controller, level, start), group in points.groupby(["controller", "level", "start"]):
        group = group.sort_values("setpoint")
        found[f"{controller}|{level}|{start}"] = {
            short: group[name].round(4).tolist() for short, name in names.items()
        }
    return found


def _traces(files: Mapping[Cell, Path]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for cell, path in files.items():
        with np.load(path.with_suffix(".npz")) as kept:
            traces = kept["traces"]
        key = f"{cell.contestant.name}|{cell.level}|{cell.start}"
        step = float(traces[0, 0, 1] - traces[0, 0, 0]) if traces.shape[2] > 1 else 0.0
        # Whole hundredths: a digit more would double the page.
        whole = np.round(100.0 * traces[:, 1:]).astype(int).tolist()
        found[key] = {"first": float(traces[0, 0, 0]), "step": step, "series": whole}
    return found


def _open_loop(rig: Rig, protocol: Protocol) -> dict[str, list[float]]:
    """Extremes of the open loop over its equilibrium speed, up to the largest set point."""
    volts = np.linspace(rig.breakaway_voltage * 1.02, protocol.config.voltage_limit, _GRID_POINTS)
    loop = open_loop_diagram(rig, volts)
    top = min(1.06 * max(protocol.setpoints), _LARGE_SPEED)
    loop = loop[loop.equilibrium <= top]
    return {name: loop[name].round(4).tolist() for name in ("equilibrium", "min", "max")}


def _facts_table(facts: pd.DataFrame) -> Markup:
    if facts.empty:
        return Markup()
    # Pandas escapes what the cells hold.
    return Markup(
        facts.to_html(index=False, border=0, na_rep="", float_format=lambda v: f"{v:.3g}")
    )


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
