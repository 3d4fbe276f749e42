"""What every command shares: output, options and the mapping of errors to exit status."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drill_env._errors import InputError
from drill_env.parameters import Rig, load_rig

if TYPE_CHECKING:
    from rich.console import Console

RigOption = Annotated[
    Path | None, typer.Option("--rig", help="Rig file; the paper's rig by default.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON document on stdout.")]


def rig_from(path: Path | None) -> Rig:
    """The rig of a file, or the paper's."""
    return Rig.paper() if path is None else load_rig(path)


def messages() -> Console:
    """Where messages and progress go: stderr, so that stdout stays clean."""
    from rich.console import Console

    return Console(stderr=True)


def print_json(document: Any) -> None:
    """One JSON document on stdout, and nothing else; NaN and infinity become null."""
    typer.echo(json.dumps(_plain(document), indent=2, allow_nan=False))


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value


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
