"""Where a command's many runs go: the options, and how their progress is shown."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from typing import Annotated

import typer

from drill_env._engine import Engine
from drill_env.cli._common import SILENT, progress_bar, tell


class EngineKind(StrEnum):
    """Where runs go."""

    LOCAL = "local"
    RAY = "ray"


JobsOption = Annotated[
    int | None, typer.Option(help="Runs at a time.", show_default="all cores, or the cluster's")
]
EngineOption = Annotated[
    EngineKind, typer.Option(help="Processes of this machine, or a Ray cluster.")
]
AddressOption = Annotated[
    str | None,
    typer.Option(
        help="Of a running Ray cluster: auto, or HOST:6379.", show_default="Ray on this machine"
    ),
]


def engine_of(jobs: int | None, engine: EngineKind, address: str | None) -> Engine:
    """The engine that the three options ask for.

    Raises:
        InputError: they contradict each other, or a number is out of range.
    """
    return Engine(engine.value, jobs, address)


@contextmanager
def counted(text: str) -> Iterator[Callable[[int, int], None]]:
    """Tells how many runs are done and when the rest will be.

    On a bar or, where nobody watches, in a line now and then.
    """
    began = last = time.monotonic()
    first: int | None = None
    with progress_bar() as bar:
        task = bar.add_task(text, total=None)

        def watch(done: int, total: int) -> None:
            nonlocal first, last
            now = time.monotonic()
            first = done if first is None else first
            bar.update(task, completed=done, total=total)
            if bar.disable and first < done < total and now - last > SILENT:
                left = (now - began) / (done - first) * (total - done)
                tell(f"{text}: {done} of {total}, {duration(left)} left ...")
                last = now

        yield watch


def duration(seconds: float) -> str:
    """A span of time in the largest unit that it fills."""
    for size, unit in ((86400.0, "d"), (3600.0, "h"), (60.0, "min")):
        if seconds >= size:
            return f"{seconds / size:.1f} {unit}"
    return f"{seconds:.0f} s"
