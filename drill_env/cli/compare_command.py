"""The command that puts controllers on one table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drill_env._errors import InputError
from drill_env.cli._common import (
    JsonOption,
    RigOption,
    numbers,
    output_folder,
    print_json,
    progress_bar,
    remarks,
    rig_from,
    show,
    tell,
)
from drill_env.cli._engine_options import (
    AddressOption,
    EngineKind,
    EngineOption,
    JobsOption,
    engine_of,
)

if TYPE_CHECKING:
    import pandas as pd

    from drill_env.controllers import Controller
    from drill_env.environment.config import EnvConfig

    Makers = dict[str, Callable[[EnvConfig], Controller]]

_NAMES = "open-loop,pi,active-damping"
OutOption = Annotated[Path, typer.Option(help="Folder for the table and the picture.")]
NamesOption = Annotated[
    str | None,
    typer.Option(
        help="Names, separated by commas, or all.", show_default=f"{_NAMES}; all with --levels"
    ),
]
AgentOption = Annotated[
    list[Path] | None,
    typer.Option(
        help="Shipped agent by name (encoders-ppo, surface-ppo), or a trained one's folder; "
        "repeatable.",
        show_default=False,
    ),
]
PointsOption = Annotated[
    str | None, typer.Option(help="rad/s, separated by commas.", show_default="12 from 0.5 to 8.5")
]
LimitOption = Annotated[
    float | None, typer.Option(help="V, up to 15.", show_default="5, or 15 with --extended")
]
SecondsOption = Annotated[float, typer.Option(help="Length of a run, s.")]
WindowOption = Annotated[float, typer.Option(help="End of a run that is judged, s.")]
SeedOption = Annotated[int, typer.Option(help="Seed of the environments.")]
LevelsOption = Annotated[
    str | None,
    typer.Option(
        help="Uncertainty levels, as L0,L1,L2,L3: runs the whole protocol.", show_default=False
    ),
]
PlantsOption = Annotated[int, typer.Option(help="Protocol: frozen plants per level.")]
StartsOption = Annotated[
    str, typer.Option(help="Protocol: of limit_cycle, rest, ring, friction_step.")
]
ExtendedOption = Annotated[
    bool, typer.Option("--extended", help="Protocol: 9 to 25 rad/s at +-15 V.")
]


def compare_command(
    out: OutOption = Path("out/compare"),
    controllers: NamesOption = None,
    agent: AgentOption = None,
    setpoints: PointsOption = None,
    rig: RigOption = None,
    voltage_limit: LimitOption = None,
    seconds: SecondsOption = 90.0,
    window: WindowOption = 30.0,
    seed: SeedOption = 0,
    levels: LevelsOption = None,
    plants: PlantsOption = 200,
    starts: StartsOption = "limit_cycle,rest,ring,friction_step",
    jobs: JobsOption = None,
    engine: EngineOption = EngineKind.LOCAL,
    address: AddressOption = None,
    extended: ExtendedOption = False,
    as_json: JsonOption = False,
) -> None:
    """Compare controllers over set points, from rest and from the limit cycle.

    Writes compare.csv, compare.parquet, compare.json and compare.png, the speeds of each
    controller over the open-loop diagram. Agents are shipped or come from train.py.

    With --levels it runs the protocol instead: every controller on frozen plants of each
    uncertainty level from four starts, in parallel, continued where it was interrupted. Writes
    summary.json, tables and index.html.

    Example: drill-env compare --controllers open-loop,pi --agent encoders-ppo --out out/compare

    Example: drill-env compare --levels L0,L1,L2,L3 --plants 200 --out out/protocol
    """
    from drill_env.benchmark import SETPOINTS
    from drill_env.environment.config import EnvConfig

    output_folder(out)
    runs_at = engine_of(jobs, engine, address)
    if extended and levels is None:
        raise InputError("--extended belongs to the protocol: give --levels too")
    with remarks():
        limit = (15.0 if extended else 5.0) if voltage_limit is None else voltage_limit
        config = EnvConfig(rig=rig_from(rig), voltage_limit=limit)
        usual = _NAMES if levels is None else "all"
        makers = _makers(usual if controllers is None else controllers, agent or [], config)
        if levels is not None:
            from drill_env.cli._protocol_mode import run_and_report

            wanted = None if setpoints is None else numbers(setpoints, "--setpoints")
            return run_and_report(
                makers, config, out, setpoints=wanted, levels=words(levels), plants=plants,
                starts=words(starts), seconds=seconds, window_s=window, seed=seed,
                engine=runs_at, extended=extended, as_json=as_json,
            )  # fmt: skip
        points = list(SETPOINTS) if setpoints is None else numbers(setpoints, "--setpoints")
        runs = _runs(makers, config, setpoints=points, seconds=seconds, window_s=window, seed=seed)
        files = write_comparison(runs, config, out)
    if as_json:
        print_json({"files": files, "setpoints": points, "runs": runs.to_dict("records")})
        return
    from drill_env.report.compare_table import compare_table

    show(compare_table(runs))
    tell("written: " + ", ".join(str(path) for path in files))


@dataclass(frozen=True, slots=True)
class TrainedMaker:
    """Loads the agent of a folder, in whichever process it is wanted."""

    folder: Path

    def __call__(self, config: EnvConfig) -> Controller:
        """The agent; it was trained for its own configuration."""
        from drill_env.agents import load

        return load(self.folder)


def words(text: str) -> list[str]:
    """Entries of a comma-separated option."""
    return [part.strip() for part in text.split(",") if part.strip()]


def _runs(makers: Makers, config: EnvConfig, **options: Any) -> pd.DataFrame:
    from drill_env.benchmark import compare

    with progress_bar() as bar:
        task = bar.add_task("comparing", total=len(makers))

        def watch(name: str, done: int, total: int) -> None:
            bar.update(task, completed=done, total=total, description=name or "done")

        return compare(makers, config, progress=watch, **options)


def _makers(controllers: str, agents: list[Path], config: EnvConfig) -> Makers:
    from drill_env import baselines
    from drill_env.agents import find

    names = list(baselines.CONTROLLERS) if controllers == "all" else words(controllers)
    for name in names:
        baselines.make(name, config)
    makers: Makers = {name: baselines.CONTROLLERS[name] for name in names}
    for agent in agents:
        folder = find(agent)
        name = folder.resolve().name
        if name in makers:
            raise InputError(
                f"two controllers are called {name}: give each once, or rename the folder {agent}"
            )
        makers[name] = TrainedMaker(folder)
        makers[name](config)
    if not makers:
        raise InputError("nothing to compare: name --controllers or give an --agent")
    return makers


def write_comparison(runs: pd.DataFrame, config: EnvConfig, out: Path) -> list[Path]:
    """Tables and picture of a comparison; returns the files."""
    import json

    from drill_env._files import make_folder, write_text
    from drill_env._tables import write_table
    from drill_env.report.compare_picture import save_compare_picture

    make_folder(out)
    files = [out / f"compare.{ending}" for ending in ("csv", "parquet", "json", "png")]
    write_table(runs, files[0])
    write_table(runs, files[1])
    write_text(files[2], json.dumps(json.loads(runs.to_json(orient="records")), indent=2) + "\n")
    save_compare_picture(runs, config.rig, config.voltage_limit, files[3])
    return files
