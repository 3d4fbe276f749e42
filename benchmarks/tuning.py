"""Tune classical controllers: `python -m benchmarks.tuning NAME...` writes baselines/gains.json.

The starts and levels of a trial run side by side; trials follow each other.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from drill_env import baselines
from drill_env._files import write_text
from drill_env.benchmark.tuning import search
from drill_env.cli._engine_options import (
    AddressOption,
    EngineKind,
    EngineOption,
    JobsOption,
    engine_of,
)


def main(
    names: Annotated[list[str], typer.Argument(help="Controllers.")],
    trials: Annotated[int, typer.Option(help="Budget of each.")] = 60,
    seed: Annotated[int, typer.Option(help="Of the search.")] = 1,
    jobs: JobsOption = None,
    engine: EngineOption = EngineKind.LOCAL,
    address: AddressOption = None,
) -> None:
    """Tune one or more controllers and write their gains."""
    runs_at = engine_of(jobs, engine, address)
    path = Path(baselines.__file__).with_name("gains.json")
    for name in names:
        item = baselines.TUNABLE[name]
        found = search(item.build, item.ranges, item.start(), trials, seed, engine=runs_at)
        # Read late, so that two searches at once keep each other's results.
        kept = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
        kept[name] = found
        write_text(path, json.dumps(dict(sorted(kept.items())), indent=2) + "\n")
        print(f"{name}: {found['score']} in {found['seconds']} s", flush=True)


if __name__ == "__main__":
    typer.run(main)
