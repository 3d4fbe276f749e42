"""What two effects cost the vector environment, beside the rig without them.

    python benchmarks/effects_speed.py [--envs 256] [--repeats 5]

One process, plain rig and rig with effects in turn, medians of the ratios of their CPU time,
compilation outside the clock. The bar is 3.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from drill_env import Rig
from drill_env.effects import LIBRARY
from drill_env.environment import DrillStringVectorEnv

PAIRS = (
    ("quadratic_drag", "string_damping"),
    ("upper_asymmetry", "upper_coulomb"),
    ("unbalance", "string_play"),
    ("encoder_eccentricity_lower", "input_delay"),
    ("friction_lag", "actuator_lag"),
)
STEPS = 60
Volts = Callable[[int], np.ndarray]


def usual(name: str) -> dict[str, object]:
    """An effect at its usual numbers."""
    numbers = {p.name: p.grid[len(p.grid) // 2] for p in LIBRARY[name].parameters}
    return {"id": name, **numbers}


def voltages(envs: int) -> dict[str, Volts]:
    """Of each way to drive: the actions of a step."""
    fresh = np.random.default_rng(0).uniform(-5.0, 5.0, (STEPS, envs, 1)).astype(np.float32)
    held = np.linspace(0.5, 5.0, envs, dtype=np.float32)[:, None]
    rest = np.zeros((envs, 1), dtype=np.float32)
    return {"random": lambda i: fresh[i % STEPS], "held": lambda _: held, "at rest": lambda _: rest}


def stepped(rig: Rig, envs: int, actions: Volts) -> Callable[[], float]:
    """An environment that has run in; a call gives the CPU time (s) of so many further steps."""
    env = DrillStringVectorEnv(envs, truth=False, rig=rig, start="rest")
    env.reset(seed=0)

    def run() -> float:
        start = time.process_time()
        for i in range(STEPS):
            env.step(actions(i))
        return time.process_time() - start

    run()
    return run


def ratio(rig: Rig, envs: int, actions: Volts, repeats: int) -> float:
    """CPU time with the rig's effects over that without."""
    plain, extended = stepped(Rig.paper(), envs, actions), stepped(rig, envs, actions)
    return statistics.median(extended() / plain() for _ in range(repeats))


def main(
    envs: Annotated[int, typer.Option(help="Environments.")] = 256,
    repeats: Annotated[int, typer.Option(help="Rounds; the medians are reported.")] = 5,
) -> None:
    """Measure and print."""
    ways = voltages(envs)
    table = Table(title=f"Two effects against none, {envs} environments, ratio of CPU time")
    table.add_column("effects")
    for name in ways:
        table.add_column(name, justify="right")
    for pair in PAIRS:
        rig = Rig.paper().replace(effects=tuple(usual(name) for name in pair))
        found = [f"{ratio(rig, envs, actions, repeats):.1f}" for actions in ways.values()]
        table.add_row(", ".join(pair), *found)
    Console().print(table)


if __name__ == "__main__":
    typer.run(main)
