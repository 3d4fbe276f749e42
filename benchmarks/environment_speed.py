"""Environment steps per CPU-second: ours beside other libraries'.

    python benchmarks/environment_speed.py [--json] [--repeats 5] [--envs 1024]

One process, all rows interleaved, medians, compilation outside the clock. The clock is
`time.process_time`, which counts every thread of the process. Encoders and filters are on,
the control period is 50 ms; a repetition of ours is a whole episode with its restarts.
Peers that are absent say so (extra `bench`).
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import typer
from peers import cartpole_vector, envpool_pendulum, gem_dc_motor
from peers.common import NotInstalledError
from peers.our_environments import adapter, feedback, fresh, held, scalar, vector
from peers.steppers import Stepper
from rich.console import Console
from rich.table import Table

VECTOR_BAR, SCALAR_BAR = 2e6, 6e4
PERIOD = 0.05


@dataclass
class Row:
    """One line of the table; rates are per CPU-second."""

    name: str
    envs: int | None = None
    steps: float | None = None
    bar: float | None = None
    substeps: float | None = None
    simulated_s: float | None = None
    spread: float | None = None
    note: str = ""


def memory() -> list[dict[str, Any]]:
    """Bytes per environment, from a fresh process: what this one freed would be used again."""
    script = Path(__file__).with_name("peers") / "our_memory.py"
    done = subprocess.run(
        [sys.executable, str(script)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        check=True, capture_output=True, text=True,
    )  # fmt: skip
    return json.loads(done.stdout)


def makers(envs: int) -> list[tuple[str, float | None, Callable[[], Stepper]]]:
    """Name, bar and maker of every row."""
    out: list[tuple[str, float | None, Callable[[], Stepper]]] = []
    ways = ((held, "held voltage"), (fresh, "random voltage each step"), (feedback, "feedback"))
    for truth in (False, True):
        for actions, name in ways:
            out.append((
                name, VECTOR_BAR,
                lambda a=actions, n=name, t=truth: vector(envs, a, n, t),
            ))  # fmt: skip
    out += [
        ("SB3 adapter", None, lambda: adapter(envs)),
        ("gym.make", SCALAR_BAR, scalar),
        ("Gymnasium CartPole", None, lambda: cartpole_vector.peer(envs)),
        ("EnvPool Pendulum", None, lambda: envpool_pendulum.peer(envs)),
        ("gym-electric-motor", None, gem_dc_motor.peer),
    ]
    return out


def substeps_per_step(stepper: Stepper) -> float:
    """Tried integrator steps per environment step, over one repetition."""
    total = 0
    for _ in range(stepper.steps):
        stepper.run(1)
        total += int(stepper.core.row["run"]["steps"].sum())
    return total / (stepper.steps * stepper.envs)


def measure(envs: int, repeats: int) -> list[Row]:
    """All rows, one repetition of each per round."""
    rows: list[Row] = []
    live: list[tuple[Row, Stepper, list[float]]] = []
    for name, bar, make in makers(envs):
        row = Row(name, bar=bar)
        rows.append(row)
        try:
            stepper = make()
        except NotInstalledError as missing:
            row.note = f"not installed ({missing})"
            continue
        row.name, row.envs = stepper.name, stepper.envs
        stepper.run(10)
        live.append((row, stepper, []))
    for _ in range(repeats):
        for _, stepper, rates in live:
            start = time.process_time()
            stepper.run(stepper.steps)
            rates.append(stepper.steps * stepper.envs / (time.process_time() - start))
    for row, stepper, rates in live:
        row.steps = statistics.median(rates)
        row.spread = (max(rates) - min(rates)) / row.steps
        if stepper.core is not None:
            row.substeps = row.steps * substeps_per_step(stepper)
            row.simulated_s = row.steps * PERIOD
    return rows


def verdict(row: Row) -> str:
    if row.bar is None or row.steps is None:
        return ""
    return f">= {row.bar:,.0f} {'met' if row.steps >= row.bar else 'MISSED'}"


def show(rows: list[Row], sizes: list[dict[str, Any]]) -> None:
    """The tables for people."""
    table = Table(title="Per CPU-second, medians of one interleaved run")
    names = ("what", "envs", "env-steps", "spread", "substeps", "simulated s", "bar")
    for column in names:
        table.add_column(column, justify="left" if column == "what" else "right")
    for row in rows:
        rates = [f"{v:,.0f}" if v else "" for v in (row.substeps, row.simulated_s)]
        table.add_row(
            row.name,
            str(row.envs or ""),
            row.note or f"{row.steps:,.0f}",
            "" if row.spread is None else f"{row.spread:.0%}",
            *rates,
            verdict(row),
        )
    console = Console()
    console.print(table)
    for size in sizes:
        grown = "unknown" if size["resident"] is None else f"{size['resident']:,.0f}"
        console.print(
            f"{size['envs']} environments: {size['arrays']:,.0f} bytes of arrays each, "
            f"process grew by {grown} bytes each"
        )


def main(
    repeats: Annotated[int, typer.Option(help="Rounds; the medians are reported.")] = 5,
    envs: Annotated[int, typer.Option(help="Environments in the vector rows.")] = 1024,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document on stdout.")] = False,
) -> None:
    """Measure and print."""
    rows = measure(envs, repeats)
    sizes = memory()
    if as_json:
        document = {
            "rows": [asdict(row) for row in rows],
            "memory_bytes_per_env": sizes,
        }
        print(json.dumps(document, indent=2))
    else:
        show(rows, sizes)


if __name__ == "__main__":
    typer.run(main)
