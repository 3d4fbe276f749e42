"""The comparison of the field: controllers over levels, starts and set points, plant by plant."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from drill_env._code import digest_of_code
from drill_env._engine import SERIAL, Engine, Progress, run
from drill_env._errors import InputError
from drill_env._files import make_folder, replacing
from drill_env._types import BoolArray, FloatArray
from drill_env.benchmark.compare import SETPOINTS
from drill_env.benchmark.contestants import Contestant
from drill_env.benchmark.measures import measure_runs, vibration_free
from drill_env.benchmark.plants import FROZEN, PLANTS_SHA256, Plants, frozen_plants
from drill_env.benchmark.rollout import PHASES, SCENARIOS, Scenario, run_plants
from drill_env.dynamics import equilibrium_voltage
from drill_env.environment.config import EnvConfig
from drill_env.environment.targets import check_setpoint
from drill_env.parameters import Level

REFERENCE_SETPOINTS: tuple[float, ...] = (1.0, 2.0, 3.0, 5.0, 7.0)
EXTENDED_SETPOINTS: tuple[float, ...] = (9.0, 11.0, 13.0, 15.0, 17.0, 19.0, 21.0, 23.0, 25.0)
EXTENDED_LIMIT = 15.0
"""The extended set spans Hopf D (13.18 V) and the fold (14.17 V) of the open loop."""

TRACE_EVERY = 8
_CODE = (
    "baselines", "parameters", "friction", "dynamics", "integrator", "sensors", "environment",
    "benchmark/rollout.py", "benchmark/measures.py", "benchmark/plants.py", "benchmark/protocol.py",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Protocol:
    """What every contestant goes through.

    Args:
        config: nominal rig, encoders, control period and voltage limit.
        setpoints: rad/s.
        levels: uncertainty sets.
        starts: how runs begin.
        plants: frozen plants per level.
        seconds: length of a run, s.
        window_s: end of a run that is judged, s.
        seed: of the ring's amplitudes.
    """

    config: EnvConfig = field(default_factory=EnvConfig)
    setpoints: tuple[float, ...] = SETPOINTS
    levels: tuple[Level, ...] = ("L0", "L1", "L2", "L3")
    starts: tuple[Scenario, ...] = SCENARIOS
    plants: int = FROZEN
    seconds: float = 90.0
    window_s: float = 30.0
    seed: int = 0

    def __post_init__(self) -> None:
        if not (self.setpoints and self.levels and self.starts):
            raise InputError("the protocol needs at least one set point, level and start")
        for setpoint in self.setpoints:
            check_setpoint(setpoint)
        for start in self.starts:
            if start not in SCENARIOS:
                raise InputError(f"start is {start!r}: give some of {', '.join(SCENARIOS)}")
        for level in self.levels:
            frozen_plants(level, self.plants)
        if not 0 < self.window_s <= self.seconds:
            raise InputError(
                f"window is {self.window_s} s: give more than 0 and at most {self.seconds} s"
            )

    @property
    def main_start(self) -> Scenario:
        """The start that summary.json tells of: the limit cycle, or else the first."""
        return "limit_cycle" if "limit_cycle" in self.starts else self.starts[0]


@dataclass(frozen=True, slots=True)
class Cell:
    """One contestant at one level from one start."""

    contestant: Contestant
    level: Level
    start: Scenario


def cells_of(contestants: Sequence[Contestant], protocol: Protocol) -> list[Cell]:
    """Every cell, contestant by contestant."""
    return [
        Cell(contestant, level, start)
        for contestant in contestants
        for level in protocol.levels
        for start in protocol.starts
    ]


def run_cell(cell: Cell, protocol: Protocol) -> tuple[pd.DataFrame, FloatArray]:
    """Run one cell.

    Returns:
        One row a run (setpoint, plant, the measures, `reachable`, `free`), and the traces of
        the first plant: (t, twist, omega_l, voltage) of every set point, shape
        (set points, 4, samples).
    """
    setpoints = np.array(protocol.setpoints)
    config = dataclasses.replace(protocol.config, episode_seconds=protocol.seconds)
    plants, copies = _distinct(frozen_plants(cell.level, protocol.plants), cell.start)
    controller = cell.contestant.maker(config)
    try:
        runs = run_plants(controller, config, plants, setpoints, cell.start, protocol.seed)
    except InputError as error:
        raise InputError(f"controller {cell.contestant.name}: {error}") from error
    targets = np.tile(setpoints, len(plants))
    table = measure_runs(
        runs.omega_l, runs.voltage, targets, config.control_period, config.voltage_limit,
        protocol.window_s,
    )  # fmt: skip
    table.insert(0, "plant", np.repeat(np.arange(len(plants)), len(setpoints)))
    table.insert(0, "setpoint", targets)
    table["reachable"] = _reachable(plants, setpoints, config)
    table["free"] = vibration_free(table)
    if len(copies) > len(plants):
        groups = [table[table.plant == source].assign(plant=i) for i, source in enumerate(copies)]
        table = pd.concat(groups, ignore_index=True)
    first = slice(None, None, TRACE_EVERY)
    times = (np.arange(len(runs.omega_l)) + 1.0)[first] * config.control_period
    columns = (runs.twist, runs.omega_l, runs.voltage)
    traces = np.array([[times, *(c[first, j] for c in columns)] for j in range(len(setpoints))])
    return table, traces


def _distinct(plants: Plants, start: Scenario) -> tuple[Plants, list[int]]:
    """Plants that need to be run, and which of them each plant is a copy of.

    At L0 all are the nominal rig: they differ by the phase they start at, if at all. The
    ring's amplitude is drawn for each.
    """
    same = bool((plants.factors == plants.factors[0]).all())
    kinds = {"rest": 1, "ring": len(plants)}.get(start, PHASES)
    if not same or kinds >= len(plants):
        return plants, list(range(len(plants)))
    few = Plants(plants.level, plants.factors[:kinds])
    return few, [i % kinds for i in range(len(plants))]


def _reachable(plants: Plants, setpoints: FloatArray, config: EnvConfig) -> BoolArray:
    """Whether the limit holds each plant at 95 % of each set point, in the order of the runs."""
    low = 0.95 * setpoints
    volts = [equilibrium_voltage(rig, low) for rig in plants.rigs(config.rig)]
    return np.concatenate(volts) <= config.voltage_limit


def cell_file(cell: Cell, protocol: Protocol, folder: Path) -> Path:
    """Where the results of a cell are kept; the name changes with all they depend on."""
    told = {
        key: getattr(protocol, key)
        for key in ("setpoints", "plants", "seconds", "window_s", "seed")
    }
    whole = json.dumps(
        [
            told,
            repr(protocol.config),
            cell.contestant.identity,
            PLANTS_SHA256,
            digest_of_code(*_CODE),
        ]
    )
    key = hashlib.sha256(whole.encode()).hexdigest()[:12]
    return folder / f"{cell.contestant.name}_{cell.level}_{cell.start}_{key}.parquet"


def _keep(table: pd.DataFrame, traces: FloatArray, path: Path) -> None:
    with replacing(path.with_suffix(".npz")) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(stream, traces=traces.astype(np.float32))
    # Last, since the table's presence says that the cell is done.
    with replacing(path) as temporary:
        table.to_parquet(temporary, index=False)


def run_protocol(
    contestants: Sequence[Contestant],
    protocol: Protocol,
    out: Path,
    *,
    engine: Engine = SERIAL,
    progress: Progress | None = None,
) -> dict[Cell, Path]:
    """Run every cell that is not there yet, in parallel; can be interrupted and resumed.

    Args:
        contestants: their names must differ.
        protocol: see `Protocol`.
        out: folder; results go to its subfolder ``cells``, one table a cell.
        engine: where they run; this process alone writes.
        progress: called with (done, total).

    Returns:
        The table's file of every cell.

    Raises:
        InputError: names are the same, or a controller gives no finite voltage.
    """
    names = [contestant.name for contestant in contestants]
    if not names or len(set(names)) < len(names):
        raise InputError("the protocol needs controllers of different names")
    folder = make_folder(out / "cells")
    files = {cell: cell_file(cell, protocol, folder) for cell in cells_of(contestants, protocol)}
    wanted = [cell for cell, path in files.items() if not path.is_file()]
    done, tell = len(files) - len(wanted), progress or (lambda done, total: None)
    runs = run(
        functools.partial(run_cell, protocol=protocol), wanted, engine,
        name=lambda cell: f"{cell.contestant.name}, {cell.level}, {cell.start}",
        progress=lambda now, _: tell(done + now, len(files)),
    )  # fmt: skip
    with closing(runs):
        for cell, (table, traces) in zip(wanted, runs, strict=True):
            _keep(table, traces, files[cell])
    return files
