"""Points of a bifurcation diagram from recordings at constant voltage, as in Fig. 5."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.signal import argrelextrema, savgol_filter

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.continuation import Diagram
from drill_env.continuation.tables import diagram_table
from drill_env.recordings import Recording

_SMOOTH_S = 0.15
_VIBRATES = 0.1


def recorded_points(
    recordings: Sequence[Recording], diagram: Diagram | None = None, settle: float = 0.4
) -> pd.DataFrame:
    """The paper's own procedure, one row a recording.

    Without vibration the mean velocity; with it the means of the local maxima and minima.

    Args:
        recordings: each at one constant voltage, with theta_l (or a column omega_l).
        diagram: computed diagram to compare with.
        settle: share of each recording dropped as transient.

    Returns:
        Columns source, voltage, mean, min, max, vibrates and, with a diagram, computed_min,
        computed_max, error_min, error_max (rad/s).

    Raises:
        InputError: a voltage is not constant, a channel is missing or the range too short.
    """
    if not 0 <= settle < 1:
        raise InputError(f"settle is {settle}: give a share from 0 to below 1")
    rows = [_row(recording, settle) for recording in recordings]
    if diagram is not None:
        table = diagram_table(diagram)
        table = table[table.stable.astype(bool)]
        for row in rows:
            row |= _computed(table, row, diagram.to_volts)
    return pd.DataFrame(rows)


def _row(recording: Recording, settle: float) -> dict[str, Any]:
    name = Path(recording.source).name
    if recording.u is None:
        raise InputError(f"{name} has no voltage: map a column to u")
    if recording.drive == "motion":
        raise InputError(f"{name}: u=unknown is no voltage; a diagram needs constant voltages")
    keep = slice(int(settle * len(recording.t)), None)
    volts = recording.u[keep]
    if np.ptp(volts) > 1e-6 + 0.002 * abs(float(volts.mean())):
        raise InputError(
            f"{name}: u varies by {np.ptp(volts):.3g} V; a diagram needs recordings at constant "
            "voltage"
        )
    speed = _speed(recording, name)[keep]
    mean = float(speed.mean())
    vibrates = bool(np.ptp(speed) > _VIBRATES * max(abs(mean), 0.5))
    low = high = mean
    if vibrates:
        low, high = _turns(speed, np.less), _turns(speed, np.greater)
    return {
        "source": name, "voltage": float(volts.mean()), "mean": mean, "min": low, "max": high,
        "vibrates": vibrates,
    }  # fmt: skip


def _speed(recording: Recording, name: str) -> FloatArray:
    if "omega_l" in recording.extra:
        return np.asarray(recording.extra["omega_l"], dtype=float)
    if recording.theta_l is None:
        raise InputError(f"{name} has neither theta_l nor omega_l: map a column to theta_l")
    step = recording.interval
    window = max(5, 2 * round(0.5 * _SMOOTH_S / step) + 1)
    if len(recording.t) < 2 * window:
        raise InputError(f"{name} is too short for a velocity: {len(recording.t)} samples")
    return savgol_filter(recording.theta_l, window, 3, deriv=1, delta=step)


def _turns(speed: FloatArray, compare: Any) -> float:
    """Mean of the outer local extremes: those beyond the middle of the range."""
    middle = 0.5 * (speed.min() + speed.max())
    places = argrelextrema(speed, compare, order=3)[0]
    outer = speed[places][compare(speed[places], middle)]
    if len(outer) == 0:
        return float(speed.min() if compare is np.less else speed.max())
    # Ripples on a plateau are extremes too; only those near the outermost count.
    edge = outer.min() if compare is np.less else outer.max()
    return float(outer[np.abs(outer - edge) < 0.2 * (speed.max() - speed.min())].mean())


def _computed(table: pd.DataFrame, row: dict[str, Any], top: float) -> dict[str, float]:
    volts = row["voltage"]
    if not 0 <= volts <= top:
        raise InputError(f"{row['source']}: {volts:.3g} V lies outside the diagram; raise --to")
    kinds = ("cycle",) if row["vibrates"] else ("sticking set", "equilibrium")
    best: dict[str, float] = {}
    for _, rows in table[table.kind.isin(kinds)].groupby("branch", sort=False):
        rows = rows.sort_values("parameter")
        if rows.parameter.min() - 0.02 <= volts <= rows.parameter.max() + 0.02:
            for side in ("min", "max"):
                best[side] = float(np.interp(volts, rows.parameter, rows[side]))
    low, high = best.get("min", float("nan")), best.get("max", float("nan"))
    return {
        "computed_min": low, "computed_max": high, "error_min": row["min"] - low,
        "error_max": row["max"] - high,
    }  # fmt: skip
