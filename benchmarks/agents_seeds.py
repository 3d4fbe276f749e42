"""Trains agents with several seeds, judges each on the frozen plants and keeps all of them.

    python benchmarks/agents_seeds.py --seeds 1,2,3 --out runs/seeds
    python benchmarks/agents_seeds.py --view surface --seeds 1,2,3 --out runs/seeds

A seed that is trained already is not trained again. Every seed of --view goes into --table, the
good and the bad; what is printed is the interquartile mean with a stratified bootstrap interval.
"""

from __future__ import annotations

import csv
import functools
import subprocess
import sys
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer
from rich.console import Console
from rich.table import Table

from drill_env._engine import run
from drill_env._tables import write_table
from drill_env.agents import load
from drill_env.benchmark.contestants import Contestant
from drill_env.benchmark.plants import LEVELS
from drill_env.benchmark.protocol import Cell, Protocol, run_cell
from drill_env.benchmark.seeds import interquartile_mean, stratified_interval
from drill_env.benchmark.summary import cell_summary
from drill_env.cli._engine_options import (
    AddressOption,
    EngineKind,
    EngineOption,
    JobsOption,
    counted,
    engine_of,
)

ROOT = Path(__file__).resolve().parent.parent
OPTIONS = {
    "both": "",
    "surface": "--view surface --history 4 --episode-seconds 25 --gamma 0.99 --log-std-init -3 "
    "--learning-rate 0.0005 --batch-size 6400 --total-steps 16000000",
}
KEPT = ("vibration_free_share", "free_of_reachable", "t50_s", "t90_s", "worst_severity_index")


def train(view: str, seed: int, folder: Path) -> None:
    if (folder / "agent.json").is_file():
        return
    command = [sys.executable, str(ROOT / "train.py"), *OPTIONS[view].split(), "--seed", str(seed)]
    subprocess.run([*command, "--skip-table", "--out", str(folder)], check=True)


def last_return(folder: Path) -> float:
    with (folder / "curve.csv").open(encoding="utf-8") as stream:
        return float(list(csv.reader(stream))[-1][1])


def judge(view: str, seed: int, folder: Path, plants: int) -> list[dict]:
    agent = load(folder)
    tier = "S" if view == "surface" else "E"
    protocol = Protocol(plants=plants, starts=("limit_cycle",))
    rows = []
    for level in LEVELS:
        one = Contestant(folder.name, lambda _: agent, tier)
        table, _ = run_cell(Cell(one, level, "limit_cycle"), protocol)
        found = cell_summary(table)
        rows.append(
            {
                "view": view, "seed": seed, "level": level, "plants": plants,
                **{name: found[name] for name in KEPT},
                "trained_steps": agent.setting["trained_steps"],
                "training_seconds": agent.setting["seconds"],
                "training_cpu_seconds": agent.setting["cpu_seconds"],
                "last_mean_return": last_return(folder),
            }
        )  # fmt: skip
    return rows


def train_and_judge(view: str, out: Path, plants: int, seed: int) -> list[dict]:
    folder = out / f"{view}-{seed}"
    train(view, seed, folder)
    return judge(view, seed, folder, plants)


def show(runs: pd.DataFrame) -> None:
    table = Table("", *LEVELS, "all levels")
    for name in KEPT[:3]:
        wide = runs.pivot(index="seed", columns="level", values=name)
        cells = [wide[[level]].to_numpy() for level in LEVELS] + [wide.to_numpy()]
        table.add_row(
            name,
            *(
                f"{interquartile_mean(c):.3f} [{stratified_interval(c)[0]:.3f}, "
                f"{stratified_interval(c)[1]:.3f}]"
                for c in cells
            ),
        )
    Console().print(table)


def main(
    seeds: Annotated[str, typer.Option(help="Separated by commas.")] = "1,2,3",
    view: Annotated[str, typer.Option(help="both or surface.")] = "both",
    out: Annotated[Path, typer.Option(help="Folder of the agents.")] = Path("runs/seeds"),
    table: Annotated[Path, typer.Option(help="CSV of all seeds.")] = ROOT
    / "benchmarks/agents_seeds.csv",
    plants: Annotated[int, typer.Option(help="Frozen plants a level.")] = 200,
    jobs: JobsOption = None,
    engine: EngineOption = EngineKind.LOCAL,
    address: AddressOption = None,
) -> None:
    wanted = [int(s) for s in seeds.split(",")]
    runs_at = engine_of(jobs, engine, address)
    with counted("seeds") as watch:
        once = functools.partial(train_and_judge, view, out.resolve(), plants)
        found = run(once, wanted, runs_at, name=lambda s: f"seed {s}", progress=watch)
        judged = list(zip(wanted, found, strict=True))
    for seed, told in judged:
        rows = pd.DataFrame(told)
        if table.is_file():
            old = pd.read_csv(table)
            rows = pd.concat([old[(old.view != view) | (old.seed != seed)], rows])
        rows = rows.sort_values(["view", "seed", "level"]).reset_index(drop=True)
        write_table(rows, table)
        print(rows[(rows.view == view) & (rows.seed == seed)].to_string(), flush=True)
    runs = pd.read_csv(table)
    runs = runs[runs.view == view]
    if runs.seed.nunique() > 1:
        show(runs)


if __name__ == "__main__":
    typer.run(main)
