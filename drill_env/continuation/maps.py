"""Two-parameter maps: where vibration begins and ends over another parameter."""

from __future__ import annotations

import functools

import numpy as np
import pandas as pd

from drill_env._engine import SERIAL, Engine, Progress, run
from drill_env._types import FloatArray
from drill_env.continuation._numbers import with_number
from drill_env.continuation._plain import returning
from drill_env.continuation.branch import StepRule
from drill_env.continuation.diagram import bifurcation_diagram
from drill_env.continuation.extended_equilibria import extended_hopf_points, turning_branch
from drill_env.continuation.hopf import HopfPoint, hopf_points
from drill_env.parameters import Rig

_COARSE = StepRule(first=0.02, largest=0.2, turn=0.5)


def hopf_map(rig: Rig, parameter: str, values: FloatArray, to_volts: float) -> pd.DataFrame:
    """Hopf points over (voltage, `parameter`).

    Returns:
        Columns value, index (by speed), voltage (V), omega (rad/s), supercritical.

    Raises:
        InputError: the parameter is unknown, a value is unphysical, or with an effect no motion
            comes back.
    """
    rows = []
    for value in values:
        for index, point in enumerate(_hopf_points(with_number(rig, parameter, value), to_volts)):
            rows.append(
                {
                    "value": float(value),
                    "index": index,
                    "voltage": point.voltage,
                    "omega": point.omega,
                    "supercritical": point.supercritical,
                }
            )
    return pd.DataFrame(rows, columns=["value", "index", "voltage", "omega", "supercritical"])


def vibration_map(
    rig: Rig,
    parameter: str,
    values: FloatArray,
    to_volts: float,
    progress: Progress | None = None,
    engine: Engine = SERIAL,
) -> pd.DataFrame:
    """Where vibration is possible over (voltage, `parameter`).

    Args:
        rig: parameters and effects, none of which follows time or an angle or never forgets; the
            parameter mapped is replaced.
        parameter: a symbol of the rig, or a number of an effect as ``string_damping.damping``.
        values: its values, ascending, shape (n,).
        to_volts: end of the voltage range, V.
        progress: called with (done, total).
        engine: where the values are computed.

    Returns:
        One row a value: hopf_low, hopf_high (V, first and last Hopf point), fold (V, highest
        fold of cycles), vibration_from and vibration_to (V, range with a stable cycle), NaN
        where there is none, reaches_end (vibration goes on beyond `to_volts`, at which
        vibration_to then stands) and failures (steps that failed, as text).

    Raises:
        InputError: as `hopf_map` does.
    """
    rows = run(
        functools.partial(_row, rig, parameter, to_volts), [float(v) for v in values], engine,
        name=lambda value: f"{parameter} = {value:g}", progress=progress,
    )  # fmt: skip
    return pd.DataFrame(list(rows))


def _hopf_points(rig: Rig, to_volts: float) -> list[HopfPoint]:
    turning = returning(rig)
    if not turning.effects:
        return hopf_points(turning, to_volts)
    return extended_hopf_points(turning, turning_branch(turning, to_volts), to_volts)


def _row(rig: Rig, parameter: str, to_volts: float, value: float) -> dict[str, object]:
    diagram = bifurcation_diagram(with_number(rig, parameter, value), to_volts, _COARSE)
    volts = [h.voltage for h in diagram.hopf]
    folds = [p.parameter for p in diagram.points if p.kind == "fold"]
    stable = [p.cycle.parameter for b in diagram.branches for p in b.points if p.cycle.stable]
    reaches = any(
        branch.end.startswith("left the range")
        and branch.points[-1].cycle.stable
        and branch.points[-1].cycle.parameter > 0.5 * to_volts
        for branch in diagram.branches
    )
    # Cycles end at Hopf points and folds, which are known better than the last step before.
    ends = np.array([*volts, *folds, *stable]) if stable else np.array([np.nan])
    ends = ends[(ends >= min(stable) - 0.3) & (ends <= max(stable) + 0.3)] if stable else ends
    return {
        "value": value,
        "hopf_low": min(volts, default=float("nan")),
        "hopf_high": max(volts) if len(volts) > 1 else float("nan"),
        "fold": max(folds, default=float("nan")),
        "vibration_from": float(ends.min()),
        "vibration_to": to_volts if reaches else float(ends.max()),
        "reaches_end": reaches,
        "failures": "; ".join(diagram.failures),
    }
