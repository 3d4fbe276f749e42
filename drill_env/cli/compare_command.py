"""The command that puts controllers on one table."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drill_env._errors import InputError
from drill_env.cli._common import JsonOption, RigOption, messages, numbers, print_json, rig_from

if TYPE_CHECKING:
    import pandas as pd

    from drill_env.environment.config import EnvConfig

_NAMES = "open-loop,pi,active-damping"


def compare_command(
    out: Annotated[Path, typer.Option(help="Folder for the table and the picture.")] = Path(
        "out/compare"
    ),
    controllers: Annotated[str, typer.Option(help="Names, separated by commas.")] = _NAMES,
    agent: Annotated[
        list[Path] | None, typer.Option(help="Folder of a trained agent; repeatable.")
    ] = None,
    setpoints: Annotated[
        str | None, typer.Option(help="Set points in rad/s, separated by commas.")
    ] = None,
    rig: RigOption = None,
    voltage_limit: Annotated[float, typer.Option(help="V, up to 15.")] = 5.0,
    seconds: Annotated[float, typer.Option(help="Length of a run, s.")] = 90.0,
    window: Annotated[float, typer.Option(help="End of a run that is judged, s.")] = 30.0,
    seed: Annotated[int, typer.Option(help="Seed of the environments.")] = 0,
    as_json: JsonOption = False,
) -> None:
    """Compare controllers over set points, from rest and from the limit cycle.

    Writes compare.csv, compare.parquet, compare.json and compare.png, the speeds of each
    controller over the open-loop diagram. Agents come from train.py.

    Example: drill-env compare --controllers open-loop,pi --out out/compare
    """
    from drill_env.environment.config import EnvConfig

    config = EnvConfig(rig=rig_from(rig), voltage_limit=voltage_limit)
    runs, points = _run(
        config, controllers, agent or [], setpoints, seconds, window, seed
    )  # fmt: skip
    files = write_comparison(runs, config, out)
    if as_json:
        print_json({"files": files, "setpoints": points, "runs": runs.to_dict("records")})
        return
    from rich.console import Console

    from drill_env.report.compare_table import compare_table

    Console().print(compare_table(runs))
    messages().print("written: " + ", ".join(str(path) for path in files))


def _run(
    config: EnvConfig,
    controllers: str,
    agents: list[Path],
    setpoints: str | None,
    seconds: float,
    window: float,
    seed: int,
) -> tuple[pd.DataFrame, list[float]]:
    from rich.progress import Progress

    from drill_env import baselines
    from drill_env.agents import load
    from drill_env.benchmark import SETPOINTS, compare

    names = [name.strip() for name in controllers.split(",") if name.strip()]
    for name in names:
        baselines.make(name, config)
    makers = {name: baselines.CONTROLLERS[name] for name in names}
    for folder in agents:
        trained = load(folder)
        if folder.name in makers:
            raise InputError(f"two controllers are called {folder.name}: rename one folder")
        makers[folder.name] = lambda _, trained=trained: trained
    points = list(SETPOINTS) if setpoints is None else numbers(setpoints, "--setpoints")
    with Progress(console=messages(), transient=True) as bar:
        task = bar.add_task("comparing", total=len(makers))

        def tell(name: str, done: int, total: int) -> None:
            bar.update(task, completed=done, total=total, description=name or "done")

        runs = compare(
            makers, config, setpoints=points, seconds=seconds, window_s=window, seed=seed,
            progress=tell,
        )  # fmt: skip
    return runs, points


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
