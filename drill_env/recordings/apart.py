"""Files read in a process of their own: a damaged one may crash it, or want all memory.

The libraries that read binary files are compiled, and a few changed bytes end scipy's reader of
MATLAB files by a segmentation fault. JSON becomes Python's objects, which may take any memory.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeAlias

from drill_env._errors import InputError, printable
from drill_env.recordings import limits
from drill_env.recordings._apart_columns import CONSTANT, OTHER, PLACE
from drill_env.recordings._read_apart import NEWER_MAT, REFUSED, TOO_LARGE

if TYPE_CHECKING:
    import pyarrow as pa

Kind: TypeAlias = Literal["parquet", "mat", "json"]
_NAMES: dict[Kind, str] = {"parquet": "Parquet", "mat": "MATLAB", "json": "JSON"}
_PROGRAM = Path(__file__).with_name("_apart_program.py")
_LIMITS = {
    "rows": limits.MOST_ROWS, "columns": limits.MOST_COLUMNS, "values": limits.MOST_VALUES,
    "bytes": limits.MOST_BYTES, "memory": limits.MOST_MEMORY,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Contents:
    """What a file holds.

    Attributes:
        columns: names and values.
        constants: single numbers by name.
        others: what else there is, in words.
    """

    columns: list[tuple[str, pa.ChunkedArray]]
    constants: dict[str, float]
    others: tuple[str, ...]


def read_apart(path: Path, kind: Kind, wanted: Sequence[str] = ()) -> Contents:
    """The contents of a Parquet, MATLAB or JSON file.

    Args:
        path: of the file.
        kind: what it is.
        wanted: texts that may be places in a MATLAB workspace, which are then columns too.

    Raises:
        InputError: the file is damaged, too large, or of a kind that is not read, or what is
            wanted of it is no vector.
    """
    import pyarrow as pa

    content = _run(path, kind, [text for text in wanted if PLACE.fullmatch(text)])
    columns: list[tuple[str, pa.ChunkedArray]] = []
    constants: dict[str, float] = {}
    others: list[str] = []
    source = pa.BufferReader(content)
    while source.tell() < len(content):
        table = pa.ipc.open_stream(source).read_all()
        name, told = table.schema.field(0).name, table.schema.metadata or {}
        if told.get(CONSTANT):
            constants[name] = float(table.column(0)[0].as_py())
        elif told.get(OTHER):
            others.append(name)
        else:
            columns.append((name, table.column(0)))
    return Contents(columns, constants, tuple(others))


def reading_seconds(path: Path, kind: Kind) -> int:
    """Seconds of CPU for a file."""
    size = path.stat().st_size
    if kind == "json":
        unpacked = size * limits.MOST_PACKED if path.suffix.lower() == ".gz" else size
        return limits.READING_SECONDS + min(unpacked, limits.MOST_BYTES) // limits.JSON_RATE
    return limits.READING_SECONDS + size // limits.READING_RATE


_TOO_LONG = (
    "reading it takes far longer than a whole file would; it is damaged or too large, copy it "
    "again or export it as CSV"
)
# SIGXCPU, which Windows has no name for.
_OUT_OF_TIME = 24


def _run(path: Path, kind: Kind, wanted: Sequence[str]) -> bytes:
    # -P: no module beside the program may hide one of the libraries'.
    seconds = reading_seconds(path, kind)
    given = json.dumps(_LIMITS | {"seconds": seconds})
    command = [sys.executable, "-P", str(_PROGRAM), kind, str(path), given, json.dumps(wanted)]
    # Pools that reserve addresses ahead would count as memory.
    environment = {**os.environ, "ARROW_DEFAULT_MEMORY_POOL": "system", "OPENBLAS_NUM_THREADS": "1"}
    try:
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, env=environment,
            timeout=limits.LONGEST_READING + seconds - limits.READING_SECONDS, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired as error:
        raise InputError(f"{path}: {_TOO_LONG}") from error
    if done.returncode == 0:
        return done.stdout
    raise InputError(f"{path}: {_reason(done.returncode, kind, done.stderr)}")


def _reason(status: int, kind: Kind, told: bytes) -> str:
    if status == REFUSED:
        return printable(told.decode("ascii", "replace").strip(), 500)
    if status == TOO_LARGE:
        return too_large_text()
    if status == -_OUT_OF_TIME:
        return _TOO_LONG
    if status == NEWER_MAT:
        return "MATLAB 7.3 files are not read; save it with save(…, '-v7')"
    return f"not a whole {_NAMES[kind]} file; copy it again, or export it as CSV"


def too_large_text() -> str:
    """The message for a file beyond the limits."""
    return (
        f"too large for a recording of the rig, which is at most {limits.MOST_ROWS:.0e} rows, "
        f"{limits.MOST_COLUMNS} columns, {limits.MOST_VALUES:.0e} values and "
        f"{limits.MOST_BYTES:.0e} bytes once unpacked; cut it into pieces, keep fewer columns or "
        "fewer samples per second"
    )
