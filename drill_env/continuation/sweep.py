"""What a rig settles on while its voltage is swept up and down, by simulation."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Literal, TypeAlias

import numpy as np
import pandas as pd

from drill_env._errors import InputError
from drill_env._types import FloatArray, IntArray
from drill_env.continuation.extended_cycle import extended_cycle
from drill_env.integrator import Trajectory, simulate
from drill_env.parameters import Rig

# Natural periods of a block and of what is looked at in the end; blocks of a short run, after which
# most have settled, and of a long one.
_BLOCK, _LOOKED_AT, _SHORT, _LONG = 10.0, 8.0, 4, 40
# Two blocks alike by so much of their swing, and of their speed, have settled; less swing than a
# share of the speed is none.
_SWING, _SPEED, _STEADY = 2e-3, 1e-4, 1e-2
_NODE = 2e-3
# As an encoder's reading would push it: an unstable equilibrium holds a rig that sits on it.
_NUDGE = 1e-3

Progress = Callable[[int, int], None]
Direction: TypeAlias = Literal["up", "down"]
Motion: TypeAlias = Literal["rest", "equilibrium", "cycle"]


@dataclass(frozen=True, slots=True)
class Attractor:
    """What a rig settles on.

    Attributes:
        voltage: V.
        direction: of the sweep that came here.
        kind: at rest, turning steadily, or vibrating.
        min: of omega_l, rad/s.
        max: of omega_l, rad/s.
        mean: of omega_l, rad/s.
        period: s from one upward crossing of the mean to the next; NaN without vibration.
        stuck: share of the time that the lower disc sticks.
        settled: whether it came to an end within the time that was given.
        multiplier: size of the largest Floquet multiplier of a cycle but the one along the flow;
            NaN where that was not asked for, or the motion is none that closes.
    """

    voltage: float
    direction: Direction
    kind: Motion
    min: float
    max: float
    mean: float
    period: float
    stuck: float
    settled: bool
    multiplier: float = math.nan


def swept(
    rig: Rig, volts: FloatArray, progress: Progress | None = None, *, multipliers: bool = False
) -> pd.DataFrame:
    """Attractors while the voltage is raised and lowered, each from where the last one ended.

    Where both ways differ, two attractors exist side by side. Time and the effects' memories
    begin anew at each voltage, so what drifts is as it is in a recording's first minutes.

    Args:
        rig: parameters and effects.
        volts: V, ascending, shape (n,).
        progress: called with voltages done and to do.
        multipliers: whether Floquet multipliers of the cycles are wanted; not of effects that
            follow time or an angle.

    Returns:
        One row an `Attractor`, with its attributes as columns; the way up comes first.

    Raises:
        InputError: an effect of the rig is wrong.
        RuntimeError: the integration failed.
    """
    state, rows = np.zeros(4), []
    ways: tuple[tuple[Direction, FloatArray], ...] = (
        ("up", volts), ("down", volts[::-1]),
    )  # fmt: skip
    for direction, values in ways:
        for value in values.tolist():
            found, state = _settle(rig, value, state, direction)
            if multipliers and found.kind == "cycle" and found.settled:
                found = replace(found, multiplier=_multiplier(rig, value, state))
            rows.append(found)
            if progress is not None:
                progress(len(rows), 2 * len(volts))
    return pd.DataFrame([asdict(row) for row in rows])


def _settle(
    rig: Rig, volts: float, start: FloatArray, direction: Direction
) -> tuple[Attractor, FloatArray]:
    """Simulate until two blocks are alike; what is settled on, and the state at the end."""
    state = start.copy()
    if state[2] > 0.0:
        state[2] *= 1.0 + _NUDGE
    block = round(_BLOCK * rig.natural_period / _NODE)
    done, settled = _run(rig, volts, state, _SHORT, block)
    if not settled:
        done, settled = _run(rig, volts, state, _LONG, block)
    speed = done.state[:, 2]
    rows = slice(-round(_LOOKED_AT * rig.natural_period / _NODE), None)
    found = _looked_at(volts, direction, speed[rows], done.modes[rows, 1], settled)
    last = done.state[-1].copy()
    last[3] = 0.0
    return found, last


def _multiplier(rig: Rig, volts: float, state: FloatArray) -> float:
    try:
        found = extended_cycle(rig, volts, state)
    except (InputError, RuntimeError):
        return math.nan
    return float(np.abs(found.multipliers).max())


def _run(
    rig: Rig, volts: float, state: FloatArray, blocks: int, block: int
) -> tuple[Trajectory, bool]:
    """So many blocks of so many samples, and whether the last two are alike."""
    times = np.asarray(_NODE * np.arange(blocks * block + 1), dtype=np.float64)
    done = simulate(
        rig, volts, float(times[-1]), t_eval=times, initial=state, method="dopri5", rtol=1e-9,
        atol=1e-11,
    )  # fmt: skip
    last = done.state[-2 * block :, 2].reshape(2, block)
    ends = np.column_stack([last.min(axis=1), last.max(axis=1)])
    return done, _alike(ends[0], ends[1])


def _alike(before: FloatArray, after: FloatArray) -> bool:
    """Whether least and greatest speed of two blocks are the same."""
    allowed = _SWING * float(np.ptp(after)) + _SPEED * (1.0 + float(np.abs(after).max()))
    return bool(np.abs(after - before).max() < allowed)


def _looked_at(
    volts: float, direction: Direction, speed: FloatArray, modes: IntArray,
    settled: bool,
) -> Attractor:  # fmt: skip
    low, high, mean = float(speed.min()), float(speed.max()), float(speed.mean())
    vibrates = high - low > _STEADY * (1.0 + abs(high))
    period = float("nan")
    if vibrates:
        upward = np.flatnonzero((speed[:-1] < mean) & (speed[1:] >= mean))
        if len(upward) > 1:
            period = float((upward[-1] - upward[0]) * _NODE / (len(upward) - 1))
    kind: Motion = "cycle" if vibrates else "equilibrium"
    if not vibrates and abs(high) < _STEADY:
        kind = "rest"
    stuck = float(np.mean(modes == 0))
    return Attractor(volts, direction, kind, low, high, mean, period, stuck, settled)
