"""Where equilibrium and limit cycle coexist: which start goes where."""

from __future__ import annotations

import functools
import math
import warnings
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd

from drill_env._engine import SERIAL, Engine, Progress, run
from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.continuation.diagram import bifurcation_diagram
from drill_env.dynamics import equilibrium_speed, equilibrium_state
from drill_env.integrator import NegativeFrictionWarning, simulate
from drill_env.parameters import Rig

_CHUNK_PERIODS, _CHUNKS = 12, 60
# Starts that a worker is sent at a time: some seconds of work.
_TOGETHER = 20

Fate = Literal["equilibrium", "limit cycle", "undecided"]


@dataclass(frozen=True, slots=True)
class Basins:
    """Shares of a box of initial states.

    Attributes:
        volts: V.
        box: half widths around the equilibrium of (twist, omega_u, omega_l).
        starts: columns twist, omega_u, omega_l, fate.
        share: share that goes to the equilibrium.
        low: lower end of its Wilson 95 % interval.
        high: upper end.
    """

    volts: float
    box: tuple[float, float, float]
    starts: pd.DataFrame
    share: float
    low: float
    high: float


def basins(
    rig: Rig, volts: float, box: tuple[float, float, float], count: int = 1000, seed: int = 0,
    engine: Engine = SERIAL, progress: Progress | None = None,
) -> Basins:  # fmt: skip
    """Draw initial states from a box around the equilibrium and follow them.

    Args:
        rig: parameters.
        volts: constant voltage, V, above break-away.
        box: half widths in twist (rad), omega_u and omega_l (rad/s).
        count: number of starts.
        seed: of the generator.
        engine: where the starts are followed.
        progress: called with groups of starts, done and in all.

    Raises:
        InputError: the box or the count is unusable, or nothing turns at this voltage.
    """
    if count < 1 or not all(math.isfinite(w) and w >= 0 for w in box):
        raise InputError(f"box {box} and count {count}: give widths of 0 or more and 1 or more")
    omega = equilibrium_speed(rig, volts)
    if omega == 0:
        raise InputError(
            f"at {volts} V nothing turns: give more than {rig.breakaway_voltage:.4g} V"
        )
    centre = equilibrium_state(rig, omega)
    starts = np.tile(centre, (count, 1))
    starts[:, :3] += np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 3)) * np.array(box)
    known = swings(rig, volts)
    groups = [starts[i : i + _TOGETHER] for i in range(0, count, _TOGETHER)]
    found = run(
        functools.partial(_fates, rig, volts, omega, known), groups, engine,
        name=lambda group: f"starts from {group[0].tolist()} on", progress=progress,
    )  # fmt: skip
    fates = [one for group in found for one in group]
    table = pd.DataFrame(starts[:, :3], columns=["twist", "omega_u", "omega_l"])
    table["fate"] = fates
    hits = int((table.fate == "equilibrium").sum())
    low, high = wilson(hits, count)
    return Basins(volts, box, table, hits / count, low, high)


def _fates(
    rig: Rig, volts: float, omega: float, known: tuple[float, float] | None, starts: FloatArray
) -> list[Fate]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NegativeFrictionWarning)
        return [fate(rig, volts, start, omega, known) for start in starts]


def swings(rig: Rig, volts: float) -> tuple[float, float] | None:
    """Swing of omega_l (max - min) on the unstable and the stable cycle, None unless both exist."""
    diagram = bifurcation_diagram(rig, 1.2 * volts)
    found: dict[bool, tuple[float, float]] = {}
    for point in (point for branch in diagram.branches for point in branch.points):
        cycle = point.cycle
        distance, swing = abs(cycle.parameter - volts), cycle.max - cycle.min
        if distance < 0.05 * volts and distance < found.get(cycle.stable, (np.inf, 0.0))[0]:
            found[cycle.stable] = (distance, swing)
    return (found[False][1], found[True][1]) if len(found) == 2 else None


def fate(
    rig: Rig, volts: float, start: FloatArray, omega: float, known: tuple[float, float] | None
) -> Fate:
    """Where one start goes.

    Decided once its swing is gone, repeats itself, or has clearly left the unstable
    cycle's and goes on in that direction.

    Args:
        rig: parameters.
        volts: V.
        start: initial state, shape (4,).
        omega: speed of the equilibrium, rad/s.
        known: swings of the unstable and the stable cycle, rad/s.
    """
    state, modes, before = start, None, None
    seconds = _CHUNK_PERIODS * rig.natural_period
    for _ in range(_CHUNKS):
        run = simulate(
            rig, volts, seconds, initial=state, modes=modes, rate=8.0 / rig.natural_period,
            rtol=1e-8,
        )  # fmt: skip
        state, modes = run.final_state.copy(), run.final_modes
        state[3] = 0.0
        swing = float(np.ptp(run.omega_l[len(run.t) // 2 :]))
        if swing < 1e-3 * max(omega, 0.1):
            return "equilibrium"
        if before is not None and known is not None:
            border, stable = known
            if swing < min(0.8 * border, before):
                return "equilibrium"
            if swing > 0.5 * (border + stable):
                return "limit cycle"
        elif before is not None and abs(swing - before) < 1e-4 * before:
            return "limit cycle"
        before = swing
    return "undecided"


def wilson(hits: int, count: int, z: float = 1.959964) -> tuple[float, float]:
    """Wilson's interval for a share."""
    share = hits / count
    middle = (share + z * z / (2 * count)) / (1 + z * z / count)
    width = (
        z * math.sqrt(share * (1 - share) / count + z * z / (4 * count**2)) / (1 + z * z / count)
    )
    return max(0.0, middle - width), min(1.0, middle + width)
