"""What a closed-loop run is judged by."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
import pandas as pd

from drill_env._types import FloatArray

BAND = 0.05
SLOW = 0.1
VIBRATION_FREE_INDEX, VIBRATION_FREE_BIAS = 0.1, 0.05


@dataclass(frozen=True, slots=True)
class Measures:
    """One run, the last `window_s` of it unless said otherwise.

    Attributes:
        severity_index: (max - min) / (2 mean) of omega_l; 0 is steady, 1 and more is stick-slip.
        mean: of omega_l, rad/s.
        min: of omega_l, rad/s.
        max: of omega_l, rad/s.
        bias: (mean - set point) / set point.
        settling_s: time after which omega_l stays within 5 % of the set point, whole run; NaN
            if it still leaves that band in the judged end.
        below_share: share of time with abs(omega_l) < 0.1 rad/s.
        reversal_share: share of time with omega_l < 0.
        rms_voltage: V.
        rms_voltage_rate: V/s.
        saturation_share: share of time at the voltage limit.
    """

    severity_index: float
    mean: float
    min: float
    max: float
    bias: float
    settling_s: float
    below_share: float
    reversal_share: float
    rms_voltage: float
    rms_voltage_rate: float
    saturation_share: float


def measure(
    omega_l: FloatArray,
    voltage: FloatArray,
    setpoint: float,
    period: float,
    limit: float,
    window_s: float = 30.0,
) -> Measures:
    """Judge one run.

    Args:
        omega_l: true velocity at the end of each control period, rad/s, shape (n,).
        voltage: voltage held in each period, V, shape (n,).
        setpoint: rad/s.
        period: control period, s.
        limit: voltage limit, V.
        window_s: length of the judged end, s.
    """
    table = measure_runs(
        omega_l[:, None], voltage[:, None], np.array([setpoint]), period, limit, window_s
    )
    return Measures(**{item.name: float(table[item.name].iloc[0]) for item in fields(Measures)})


def measure_runs(
    omega_l: FloatArray,
    voltage: FloatArray,
    setpoints: FloatArray,
    period: float,
    limit: float,
    window_s: float = 30.0,
) -> pd.DataFrame:
    """Judge many runs; arguments as in `measure`, series of shape (steps, runs).

    Returns:
        One row a run, the fields of `Measures` as columns.
    """
    count = min(len(omega_l), max(1, round(window_s / period)))
    tail, volts = omega_l[-count:], voltage[-count:]
    mean, low, high = tail.mean(axis=0), tail.min(axis=0), tail.max(axis=0)
    # Put this way round, NaN counts as outside.
    outside = ~(np.abs(omega_l - setpoints) <= BAND * setpoints)
    last = np.where(outside.any(axis=0), len(omega_l) - np.argmax(outside[::-1], axis=0), 0)
    rate = np.diff(volts, axis=0) / period
    with np.errstate(divide="ignore", invalid="ignore"):
        severity = np.where(mean > 1e-9, (high - low) / (2.0 * mean), np.inf)
    return pd.DataFrame(
        {
            "severity_index": severity,
            "mean": mean,
            "min": low,
            "max": high,
            "bias": (mean - setpoints) / setpoints,
            "settling_s": np.where(last > len(omega_l) - count, np.nan, last * period),
            "below_share": (np.abs(tail) < SLOW).mean(axis=0),
            "reversal_share": (tail < 0.0).mean(axis=0),
            "rms_voltage": np.sqrt(np.mean(volts**2, axis=0)),
            "rms_voltage_rate": np.sqrt(np.mean(rate**2, axis=0)) if len(rate) else 0.0,
            "saturation_share": (np.abs(volts) >= limit * (1.0 - 1e-6)).mean(axis=0),
        }
    )


def vibration_free(runs: pd.DataFrame) -> pd.Series:
    """Which runs end with severity index < 0.1 and bias < 5 %."""
    return (runs.severity_index < VIBRATION_FREE_INDEX) & (runs.bias.abs() < VIBRATION_FREE_BIAS)
