"""The comparison as a table for the terminal."""

from __future__ import annotations

import pandas as pd
from rich.table import Table

VIBRATION_FREE_INDEX, VIBRATION_FREE_BIAS = 0.1, 0.05


def vibration_free(runs: pd.DataFrame) -> pd.Series:
    """Which runs end with severity index < 0.1 and bias < 5 %."""
    return (runs.severity_index < VIBRATION_FREE_INDEX) & (runs.bias.abs() < VIBRATION_FREE_BIAS)


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
