"""The comparison as a table for the terminal."""

from __future__ import annotations

import pandas as pd
from rich.table import Table

from drill_env.benchmark.measures import vibration_free


def compare_table(runs: pd.DataFrame) -> Table:
    """One row a controller and start: how many set points are free of vibration, and how.

    Medians over the set points; that of the settling time over those that settle.
    """
    table = Table(
        title="Set points free of vibration, medians over the set points", title_justify="left"
    )
    table.add_column("controller")
    table.add_column("start")
    for name in ("free", "severity index", "|bias| %", "settled", "settling s", "rms V/s"):
        table.add_column(name, justify="right")
    runs = runs.assign(free=vibration_free(runs))
    for (controller, start), group in runs.groupby(["controller", "start"], sort=False):
        settled = group.settling_s.dropna()
        table.add_row(
            str(controller), str(start), f"{int(group.free.sum())} of {len(group)}",
            f"{group.severity_index.median():.3f}", f"{100 * group.bias.abs().median():.2f}",
            f"{len(settled)} of {len(group)}", f"{settled.median():.1f}" if len(settled) else "-",
            f"{group.rms_voltage_rate.median():.2f}",
        )  # fmt: skip
    return table


def protocol_table(whole: pd.DataFrame, start: str) -> Table:
    """One row a controller: the vibration-free share of each level, from one start.

    Args:
        whole: one row a cell, of `drill_env.benchmark.summary.read_cells`.
        start: the start to show.
    """
    rows = whole[whole.start == start]
    levels = list(dict.fromkeys(rows.level))
    title = f"Vibration-free share (95 % interval) and t50, from {start.replace('_', ' ')}"
    table = Table(title=title, title_justify="left")
    table.add_column("controller")
    table.add_column("tier")
    for level in levels:
        table.add_column(level, justify="right")
    for (controller, tier), group in rows.groupby(["controller", "tier"], sort=False):
        known = {item.level: item for item in group.itertuples()}
        cells = []
        for level in levels:
            item = known[level]
            text = f"{item.vibration_free_share:.3f} ({item.low:.2f}-{item.high:.2f})"
            cells.append(text + (f" {item.t50_s:.1f} s" if item.t50_s < float("inf") else ""))
        table.add_row(str(controller), str(tier), *cells)
    return table
