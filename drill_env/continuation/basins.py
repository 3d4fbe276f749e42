"""Where equilibrium and limit cycle coexist: which start goes where."""

from __future__ import annotations

import functools
import math
import warnings
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import pandas as pd

from drill_env._engine import SERIAL, Engine, Progress, run
from drill_env._errors import InputError
from drill_env._types import FloatArray, IntArray
from drill_env.continuation._plain import returning
from drill_env.continuation.diagram import bifurcation_diagram
from drill_env.continuation.extended_equilibria import turning_at
from drill_env.dynamics import equilibrium_speed, equilibrium_state
from drill_env.integrator import Disc, Kind, NegativeFrictionWarning, Trajectory, simulate
from drill_env.parameters import Rig

_CHUNK_PERIODS, _CHUNKS = 12, 60
# Starts that a worker is sent at a time: some seconds of work.
_TOGETHER = 20
# Steady where it swings by less than a share of the speed, at the equilibrium's speed to another;
# the same motion, or memory, as before to a third.
_STEADY, _NEAR, _SAME = 1e-3, 1e-2, 1e-4
# Where its friction rises with speed a disc comes to rest as e^-t, and never quite.
_RESTS = 1e-6

Fate: TypeAlias = Literal["equilibrium", "limit cycle", "rest", "another equilibrium", "undecided"]
"""Where a start goes; a rig with effects may also rest, or turn steadily in another state."""


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

    Where effects leave several equilibria, the box lies around the fastest stable one, or the
    fastest. The effects' inner states start as those of a simulation from that state do: a memory
    begins empty, a lag in balance with the drawn state and the voltage.

    Args:
        rig: parameters and effects, none of which follows time or an angle or never forgets.
        volts: constant voltage, V, above break-away.
        box: half widths in twist (rad), omega_u and omega_l (rad/s).
        count: number of starts.
        seed: of the generator.
        engine: where the starts are followed.
        progress: called with groups of starts, done and in all.

    Raises:
        InputError: the box or the count is unusable, nothing turns at this voltage, or with an
            effect no motion comes back.
    """
    if count < 1 or not all(math.isfinite(w) and w >= 0 for w in box):
        raise InputError(f"box {box} and count {count}: give widths of 0 or more and 1 or more")
    turning = returning(rig)
    centre = _centre(turning, volts)
    starts = np.tile(np.append(centre[:3], 0.0), (count, 1))
    starts[:, :3] += np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 3)) * np.array(box)
    # A swing alone does not tell on which side of the border a rig with a memory is.
    known = swings(turning, volts) if len(centre) == 3 else None
    groups = [starts[i : i + _TOGETHER] for i in range(0, count, _TOGETHER)]
    found = run(
        functools.partial(_fates, turning, volts, centre, known), groups, engine,
        name=lambda group: f"starts from {group[0].tolist()} on", progress=progress,
    )  # fmt: skip
    fates = [one for group in found for one in group]
    table = pd.DataFrame(starts[:, :3], columns=["twist", "omega_u", "omega_l"])
    table["fate"] = fates
    hits = int((table.fate == "equilibrium").sum())
    low, high = wilson(hits, count)
    return Basins(volts, box, table, hits / count, low, high)


def _centre(rig: Rig, volts: float) -> FloatArray:
    """Twist, omega_u, omega_l and inner states of the equilibrium, shape (3 + m,)."""
    if rig.effects:
        found = turning_at(rig, volts)
        if not found:
            raise InputError(f"at {volts} V no equilibrium turns: give another voltage")
        stable = [state for state, holds in found if holds]
        return stable[-1] if stable else found[-1][0]
    omega = equilibrium_speed(rig, volts)
    if omega == 0:
        raise InputError(
            f"at {volts} V nothing turns: give more than {rig.breakaway_voltage:.4g} V"
        )
    return equilibrium_state(rig, omega)[:3]


class _Stretch:
    """Some periods of a motion.

    Args:
        rig: parameters and effects.
        volts: V.
        state: at its start, shape (4,).
        modes: of the discs there, shape (3,); by the state by default.
        inner: inner states there; those of a new run by default.
    """

    def __init__(
        self, rig: Rig, volts: float, state: FloatArray, modes: IntArray | None = None,
        inner: FloatArray | None = None,
    ) -> None:  # fmt: skip
        self._rig, self._volts, self._state, self._modes = rig, volts, state, modes
        times = np.arange(8 * _CHUNK_PERIODS) * rig.natural_period / 8.0
        self.run = self._simulate(inner, np.asarray(times, dtype=np.float64))
        self.inner = self.run.inner[0]

    def _simulate(self, inner: FloatArray | None, times: FloatArray) -> Trajectory:
        return simulate(
            self._rig, self._volts, _CHUNK_PERIODS * self._rig.natural_period, t_eval=times,
            initial=self._state, modes=self._modes, inner=inner, rtol=1e-8, extrema=True,
        )  # fmt: skip

    @property
    def swing(self) -> float:
        """Of omega_l in the second half; samples alone miss its extremes."""
        half, marks = self.run.t[len(self.run.t) // 2], self.run.events.where(Disc.LOWER)
        late = self.run.omega_l[self.run.t >= half]
        return float(np.ptp(np.concatenate([late, marks.state[marks.t >= half, 2]])))

    def remembers(self) -> bool:
        """Whether the memories are the same at the first and the last greatest omega_l."""
        if not len(self.inner):
            return True
        tops = self.run.events.where(Disc.LOWER, Kind.MAXIMUM)
        t = tops.t[tops.state[:, 2] > tops.state[:, 2].max() - _SAME * self.swing]
        inner = self._simulate(self.inner, np.array([t[0], t[-1]])).inner
        return len(t) > 1 and _alike(inner[0], inner[1], _SAME)

    def next(self) -> _Stretch:
        """The one that follows."""
        state = self.run.final_state.copy()
        state[3] = 0.0
        return _Stretch(self._rig, self._volts, state, self.run.final_modes, self.run.final_inner)


def _fates(
    rig: Rig, volts: float, centre: FloatArray, known: tuple[float, float] | None,
    starts: FloatArray,
) -> list[Fate]:  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NegativeFrictionWarning)
        return [fate(rig, volts, start, centre, known) for start in starts]


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
    rig: Rig, volts: float, start: FloatArray, centre: FloatArray,
    known: tuple[float, float] | None,
) -> Fate:  # fmt: skip
    """Where one start goes.

    Decided once its swing is gone, repeats itself, or has clearly left the unstable
    cycle's and goes on in that direction; of a rig with memories, once these repeat too.

    Args:
        rig: parameters and effects.
        volts: V.
        start: initial state, shape (4,).
        centre: twist, omega_u, omega_l and inner states of the equilibrium, shape (3 + m,).
        known: swings of the unstable and the stable cycle, rad/s.

    Raises:
        RuntimeError: an integration failed.
    """
    stretch, before = _Stretch(rig, volts, start), math.inf
    for _ in range(_CHUNKS):
        swing = stretch.swing
        if swing < _STEADY * max(float(centre[2]), 0.1):
            ended = _steady(stretch, centre)
            if ended is not None:
                return ended
        elif known is not None and math.isfinite(before):
            border, stable = known
            if swing < min(0.8 * border, before):
                return "equilibrium"
            if swing > 0.5 * (border + stable):
                return "limit cycle"
        elif abs(swing - before) < _SAME * before and stretch.remembers():
            return "limit cycle"
        before, stretch = swing, stretch.next()
    return "undecided"


def _steady(stretch: _Stretch, centre: FloatArray) -> Fate | None:
    """Which steady state a rig without swing is in; None while its memories still change."""
    speeds, inner = stretch.run.final_state[1:3], stretch.run.final_inner
    size = max(float(centre[2]), 0.1)
    near = abs(speeds[1] - centre[2]) < _NEAR * size
    if near and _alike(inner, centre[3:], _STEADY):
        return "equilibrium"
    slow, moves = abs(speeds[1]) < _NEAR * size, np.abs(speeds).max() > _RESTS * size
    if near or (slow and moves) or not _alike(inner, stretch.inner, _SAME):
        return None
    return "rest" if slow else "another equilibrium"


def _alike(memories: FloatArray, others: FloatArray, share: float) -> bool:
    return bool((np.abs(memories - others) < share * (1.0 + np.abs(others))).all())


def wilson(hits: int, count: int, z: float = 1.959964) -> tuple[float, float]:
    """Wilson's interval for a share."""
    share = hits / count
    middle = (share + z * z / (2 * count)) / (1 + z * z / count)
    width = (
        z * math.sqrt(share * (1 - share) / count + z * z / (4 * count**2)) / (1 + z * z / count)
    )
    return max(0.0, middle - width), min(1.0, middle + width)
