"""Shares, settling times and intervals out of the protocol's runs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from drill_env._types import FloatArray
from drill_env.benchmark.protocol import Cell, Protocol

_RESAMPLES = 2000
_SUMMARY = (
    "controller", "tier", "level", "start", "vibration_free_share", "low", "high", "t50_s",
    "t90_s", "plants", "setpoints",
)  # fmt: skip


def bootstrap_interval(
    per_plant: FloatArray, seed: int = 0, resamples: int = _RESAMPLES
) -> tuple[float, float]:
    """95 % interval of a mean by drawing whole plants anew.

    The set points of one plant share its fortune, so that runs are no independent draws.

    Args:
        per_plant: mean of each plant over its set points, shape (n,).
        seed: of the draws.
        resamples: number of draws.
    """
    rng, count = np.random.default_rng(seed), len(per_plant)
    means = per_plant[rng.integers(0, count, (resamples, count))].mean(axis=1)
    low, high = np.quantile(means, [0.025, 0.975])
    return float(low), float(high)


def settling_quantile(settling_s: pd.Series, share: float) -> float:
    """Time by which this share of runs has settled; infinite where it never does."""
    times = np.sort(settling_s.fillna(np.inf).to_numpy())
    return float(times[min(int(np.ceil(share * len(times))), len(times)) - 1])


def cell_summary(runs: pd.DataFrame) -> dict[str, Any]:
    """One cell in a row of numbers; times in s, voltages in V, shares from 0 to 1."""
    per_plant = runs.groupby("plant").free.mean().to_numpy()
    low, high = bootstrap_interval(per_plant)
    within = runs[runs.reachable]
    return {
        "vibration_free_share": float(runs.free.mean()),
        "low": low,
        "high": high,
        "t50_s": settling_quantile(runs.settling_s, 0.5),
        "t90_s": settling_quantile(runs.settling_s, 0.9),
        "reachable_share": float(runs.reachable.mean()),
        "free_of_reachable": float(within.free.mean()) if len(within) else float("nan"),
        "median_severity_index": float(runs.severity_index.median()),
        "worst_severity_index": float(runs.severity_index.max()),
        "median_bias": float(runs.bias.abs().median()),
        "worst_bias": float(runs.bias.abs().max()),
        "rms_voltage": float(runs.rms_voltage.mean()),
        "rms_voltage_rate": float(runs.rms_voltage_rate.mean()),
        "saturation_share": float(runs.saturation_share.mean()),
        "below_share": float(runs.below_share.mean()),
        "plants": int(runs.plant.nunique()),
        "setpoints": int(runs.setpoint.nunique()),
    }


def read_cells(files: Mapping[Cell, Path]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Every cell as one row, and every cell's set points one row each."""
    whole, points = [], []
    for cell, path in files.items():
        runs = pd.read_parquet(path)
        where = {
            "controller": cell.contestant.name, "tier": cell.contestant.tier,
            "ranked": cell.contestant.ranked, "level": cell.level, "start": cell.start,
        }  # fmt: skip
        whole.append(where | cell_summary(runs))
        for setpoint, group in runs.groupby("setpoint"):
            place = {"setpoint": setpoint, "min": group["min"].min(), "max": group["max"].max()}
            middle = {name: group[name].median() for name in ("mean", "severity_index")}
            swing = {f"median_{name}": group[name].median() for name in ("min", "max")}
            points.append(where | place | middle | swing | cell_summary(group))
    return pd.DataFrame(whole), pd.DataFrame(points)


def summary_rows(whole: pd.DataFrame, protocol: Protocol) -> list[dict[str, Any]]:
    """The rows of summary.json: one a controller and level, from the main start."""
    rows = whole[whole.start == protocol.main_start]
    return [{name: row[name] for name in _SUMMARY} for row in rows.to_dict("records")]


def ranking(whole: pd.DataFrame, protocol: Protocol) -> pd.DataFrame:
    """Fair contestants, tier by tier, best first: mean share over levels, then settling time.

    Returns:
        Columns tier, rank, controller, mean_share, then share, low, high and t50_s of each
        level as ``L0``, ``L0_low``, ...
    """
    rows = []
    main = whole[(whole.start == protocol.main_start) & whole.ranked]
    for (tier, name), group in main.groupby(["tier", "controller"], sort=False):
        row: dict[str, Any] = {"tier": tier, "controller": name}
        row["mean_share"] = float(group.vibration_free_share.mean())
        for item in group.itertuples():
            row[str(item.level)] = item.vibration_free_share
            row[f"{item.level}_low"], row[f"{item.level}_high"] = item.low, item.high
            row[f"{item.level}_t50_s"] = item.t50_s
        row["_slow"] = float(np.mean(np.minimum(group.t50_s, protocol.seconds)))
        rows.append(row)
    table = pd.DataFrame(rows).sort_values(
        ["tier", "mean_share", "_slow"], ascending=[True, False, True], kind="stable"
    )
    table.insert(1, "rank", table.groupby("tier").cumcount() + 1)
    return table.drop(columns="_slow").reset_index(drop=True)
