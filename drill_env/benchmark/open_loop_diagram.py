"""The open-loop behaviour at constant voltage, by simulation to the steady state."""

from __future__ import annotations

import warnings

import numpy as np
import pandas as pd

from drill_env._types import FloatArray
from drill_env.dynamics import equilibrium_speed
from drill_env.integrator import Disc, Kind, NegativeFrictionWarning, simulate
from drill_env.parameters import Rig

_SETTLE_S = 120.0
_WATCH_PERIODS = 4.0


def open_loop_diagram(rig: Rig, volts: FloatArray) -> pd.DataFrame:
    """Extremes of omega_l after settling, voltage by voltage.

    Every voltage starts from the state the one before ended in, so a rising grid
    follows one branch where two coexist.

    Args:
        rig: parameters.
        volts: voltages in V, ascending, shape (n,).

    Returns:
        Columns voltage, equilibrium, min, max (rad/s) and period (s, NaN if steady).
    """
    rows, state = [], None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NegativeFrictionWarning)
        for value in volts:
            row, state = _settled(rig, float(value), state)
            rows.append(row)
    return pd.DataFrame(rows)


def _settled(
    rig: Rig, volts: float, state: FloatArray | None
) -> tuple[dict[str, float], FloatArray]:
    settled = simulate(rig, volts, _SETTLE_S, initial=state, t_eval=np.zeros(0))
    watch = _WATCH_PERIODS * rig.natural_period
    end = simulate(
        rig, volts, watch, initial=settled.final_state, modes=settled.final_modes, extrema=True
    )
    speeds = np.append(end.omega_l, end.events.state[:, 2])
    peaks = end.events.where(Disc.LOWER, Kind.MAXIMUM).t
    vibrates = speeds.max() - speeds.min() > 1e-3 and len(peaks) > 1
    last = end.final_state.copy()
    last[3] = 0.0
    row = {
        "voltage": volts,
        "equilibrium": equilibrium_speed(rig, volts),
        "min": float(speeds.min()),
        "max": float(speeds.max()),
        "period": float(np.diff(peaks).mean()) if vibrates else float("nan"),
    }
    return row, last
