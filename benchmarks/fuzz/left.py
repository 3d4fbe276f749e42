"""What a command leaves when it ends: files whole, half or temporary, processes, a status."""

from __future__ import annotations

import gzip
import json
import os
import signal
import time
import tomllib
from collections.abc import Callable
from pathlib import Path
from zipfile import ZipFile

import pandas as pd


def _zip(path: Path) -> None:
    with ZipFile(path) as archive:
        assert archive.testzip() is None


def _html(path: Path) -> None:
    assert path.read_text(encoding="utf-8").rstrip().endswith("</html>")


def _picture(path: Path) -> None:
    from matplotlib.image import imread

    imread(path)


READERS: dict[str, Callable[[Path], object]] = {
    ".json": lambda path: json.loads(path.read_text(encoding="utf-8")), ".csv": pd.read_csv,
    ".parquet": pd.read_parquet, ".toml": lambda path: tomllib.loads(path.read_text("utf-8")),
    ".png": _picture, ".npz": _zip, ".zip": _zip, ".html": _html,
    ".gz": lambda path: gzip.decompress(path.read_bytes()),
}  # fmt: skip


def outputs(folder: Path) -> list[Path]:
    """Files at their final names."""
    return sorted(p for p in folder.rglob("*") if p.is_file() and not p.name.startswith("."))


def leftovers(folder: Path) -> list[Path]:
    """Temporary files that were never put in place."""
    return sorted(p for p in folder.rglob(".*") if p.is_file())


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in outputs(folder)}


def broken(folder: Path) -> list[str]:
    """Which of the files cannot be read whole."""
    faults = []
    for path in outputs(folder):
        try:
            READERS[path.suffix](path)
        except Exception as error:
            faults.append(f"{path.name} is half there, {error}")
    return faults


def running(group: int) -> bool:
    """Whether processes of a group are there."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def go_on(group: int) -> bool:
    """Whether they still are after a while."""
    until = time.monotonic() + 5.0
    while running(group) and time.monotonic() < until:
        time.sleep(0.05)
    return running(group)


def last(folder: Path) -> str:
    """The output that was written last, by its place in the folder."""
    newest = max(outputs(folder), key=lambda path: path.stat().st_mtime_ns)
    return str(newest.relative_to(folder))


def since(path: Path, began: float) -> bool:
    """Whether a file was written since then."""
    return path.is_file() and path.stat().st_mtime >= began


def interrupted(status: int, number: int, err: str, *, late: bool) -> list[str]:
    """What is wrong with how a command ended that was asked to end.

    Args:
        status: exit status, negative for a signal that ended it.
        number: of the signal.
        err: its standard error.
        late: whether all may have been done: while Python ends it leaves signals to the system.
    """
    # A shell gives 128 + 15 for what SIGTERM ended by default, too: before Python has its handlers.
    ended = (128 + number, 0, *([-number] if late or number == signal.SIGTERM else []))
    faults = [] if status in ended else [f"exit status {status}"]
    # Joblib's tracker of shared memory outlives its parent and tells what it found gone.
    err = "\n".join(line for line in err.splitlines() if "resource_tracker" not in line)
    if "Traceback" in err or "Error" in err:
        faults.append(f"says {err[-600:]!r}")
    elif status == 130 and "interrupted" not in err and "go on" not in err:
        faults.append(f"says {err[-600:]!r}, not that it was interrupted")
    return faults
