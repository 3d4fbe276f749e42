"""What every command shares: options, output, remarks and folders."""

from __future__ import annotations

import json
import math
import os
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand

from drill_env._documents import plain
from drill_env._errors import InputError, printable
from drill_env._watch import stopwatch
from drill_env.parameters import Rig, load_rig

if TYPE_CHECKING:
    from types import FrameType

    from rich.progress import Progress
    from rich.table import Table

RigOption = Annotated[
    Path | None, typer.Option("--rig", help="Rig file; the paper's rig by default.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON document on stdout.")]
_MAP_HELP = (
    "CHANNEL=COLUMN[:UNIT], repeatable: t (s ms us), u (V mV) or torque (Nm mNm N), theta_u and "
    "theta_l (rad deg turn counts/N m), omega_u and omega_l (rad/s rpm deg/s m/s), or a number to "
    "multiply by; u=0 where nothing drives. Example: --map theta_u=enc:counts/8192"
)
MapOption = Annotated[list[str] | None, typer.Option("--map", help=_MAP_HELP, show_default=False)]


class SeveralHoldouts(TyperCommand):
    """Lets ``--holdout A B C`` take all three; otherwise B and C would be fitted."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        spread: list[str] = []
        inside = False
        for arg in args:
            if inside and not arg.startswith("-") and spread[-1] != "--holdout":
                spread.append("--holdout")
            elif arg.startswith("-"):
                inside = arg == "--holdout"
            spread.append(arg)
        return super().parse_args(ctx, spread)


SILENT = 10.0
"""Seconds after which a log gets a line."""


def rig_from(path: Path | None) -> Rig:
    """The rig of a file, or the paper's."""
    if path is None:
        return Rig.paper()
    rig = load_rig(path)
    if rig.effects:
        from drill_env.effects.declared import declared

        try:
            declared(rig)
        except InputError as error:
            raise InputError(f"rig file {path}: {error}") from error
    return rig


def tell(text: str) -> None:
    """One message on stderr, so that stdout stays clean."""
    typer.echo(text, err=True)


def progress_bar() -> Progress:
    """A bar on stderr that vanishes when done, and never shows where nobody watches."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    return Progress(console=console, transient=True, disable=not console.is_terminal)


def stages(
    bar: Progress, most: float = math.inf, asked: threading.Event | None = None
) -> Callable[[str], bool]:
    """Tells what is being done: on the bar or, where nobody watches, in a line now and then.

    Args:
        bar: of `progress_bar`.
        most: seconds of a `stopwatch` that the work takes at most.
        asked: set once the work is to end; that is what the report returns.
    """
    task, last, worked = bar.add_task("reading", total=None), time.monotonic(), stopwatch()

    def tell_stage(text: str) -> bool:
        nonlocal last
        left = "" if math.isinf(most) else f" ({worked():.0f} of at most {most:.0f} s)"
        bar.update(task, description=text + left)
        if bar.disable and time.monotonic() - last > SILENT:
            tell(f"{text}{left} ...")
            last = time.monotonic()
        return asked is not None and asked.is_set()

    return tell_stage


@contextmanager
def first_interrupt() -> Iterator[threading.Event]:
    """An event that the first interrupt sets; the second one interrupts."""
    asked, usual = threading.Event(), signal.getsignal(signal.SIGINT)

    def note(number: int, frame: FrameType | None) -> None:
        asked.set()
        signal.signal(number, usual)
        tell("ending with what is known; interrupt again to stop at once")

    if usual is signal.SIG_IGN:
        # Whoever began this in the background has the interrupts for himself.
        yield asked
        return
    signal.signal(signal.SIGINT, note)
    try:
        yield asked
    finally:
        signal.signal(signal.SIGINT, usual)


def show(table: Table) -> None:
    """A table on stdout, in full width where stdout is no terminal."""
    from rich.console import Console

    # A name in brackets is no mark-up.
    console = Console(markup=False)
    if not console.is_terminal:
        console = Console(width=120, markup=False)
    console.print(table)


def print_json(document: Any) -> None:
    """One JSON document on stdout, and nothing else; NaN and infinity become null."""
    typer.echo(json.dumps(plain(document), indent=2, allow_nan=False))


@contextmanager
def remarks() -> Iterator[None]:
    """Warnings as one plain line each on stderr; none where an error says it all."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        for kind in (DeprecationWarning, PendingDeprecationWarning, FutureWarning):
            warnings.simplefilter("ignore", kind)
        yield
        for text in dict.fromkeys(str(remark.message) for remark in found):
            tell(f"warning: {printable(text)}")


def output_folder(path: Path) -> Path:
    """The folder of --out, checked before any work is done; it need not exist yet.

    Raises:
        InputError: a file is in the way, or the folder cannot be written.
    """
    nearest = next((p for p in (path, *path.absolute().parents) if p.exists()), path)
    if not nearest.is_dir():
        raise InputError(f"--out {path}: {nearest} is a file; give a folder")
    if not os.access(nearest, os.W_OK):
        raise InputError(f"--out {path}: {nearest} is not writable; give another folder")
    return path


def output_file(path: Path) -> Path:
    """The file of --out, its folder checked before any work is done.

    Raises:
        InputError: it is a folder, or its folder does not exist.
    """
    if path.is_dir():
        raise InputError(f"--out {path} is a folder: give a file name")
    if not path.parent.is_dir():
        raise InputError(f"--out {path}: there is no folder {path.parent}; make it first")
    return path


def numbers(text: str, option: str) -> list[float]:
    """Comma-separated numbers of an option.

    Raises:
        InputError: an entry is no finite number.
    """
    try:
        found = [float(part) for part in text.split(",") if part.strip()]
    except ValueError as error:
        raise InputError(f"{option} is {text!r}: give numbers separated by commas") from error
    if not found or not all(math.isfinite(value) for value in found):
        raise InputError(f"{option} is {text!r}: give finite numbers separated by commas")
    return found
