"""What a closed-loop run is judged by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drill_env._types import FloatArray

BAND = 0.05
SLOW = 0.1


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
    count = min(len(omega_l), max(1, round(window_s / period)))
    tail, volts = omega_l[-count:], voltage[-count:]
    mean, low, high = float(tail.mean()), float(tail.min()), float(tail.max())
    # Put this way round, NaN counts as outside.
    outside = np.flatnonzero(~(np.abs(omega_l - setpoint) <= BAND * setpoint))
    last = int(outside[-1]) + 1 if len(outside) else 0
    rate = np.diff(volts) / period
    return Measures(
        severity_index=(high - low) / (2.0 * mean) if mean > 1e-9 else float("inf"),
        mean=mean,
        min=low,
        max=high,
        bias=(mean - setpoint) / setpoint,
        settling_s=float("nan") if last > len(omega_l) - count else last * period,
        below_share=float((np.abs(tail) < SLOW).mean()),
        reversal_share=float((tail < 0.0).mean()),
        rms_voltage=float(np.sqrt(np.mean(volts**2))),
        rms_voltage_rate=float(np.sqrt(np.mean(rate**2))) if len(rate) else 0.0,
        saturation_share=float((np.abs(volts) >= limit * (1.0 - 1e-6)).mean()),
    )
