"""Long work that is killed: `python -m benchmarks.fuzz.killed [WORK...] --kills 50 --seed 1`.

Each command is ended at random moments by SIGKILL, SIGINT and SIGTERM in turn, sent to it alone or,
as a terminal does, to all its processes. Then no output may be half there, none of its processes
may go on, an interrupt is one line and exit status 130, and to run it again gives what it gives
when nothing happens.
"""

from __future__ import annotations

import gzip
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated
from zipfile import ZipFile

import numpy as np
import pandas as pd
import typer

from benchmarks.fuzz.works import ROOT, WORKS, Work, recordings
from drill_env._files import make_folder

SIGNALS = (signal.SIGKILL, signal.SIGINT, signal.SIGTERM)
LOG = "log"
BEGUN = 1.5
"""Seconds after which Python and the package are imported; before, an interrupt is Python's own."""
PATIENCE = 60.0
"""Seconds within which a command must end after an interrupt, and its processes after it."""


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


@dataclass
class Tally:
    """What a command has gone through, and what was wrong."""

    sent: Counter[str] = field(default_factory=Counter)
    ended: int = 0
    again: int = 0
    temporary: int = 0
    slowest: float = 0.0
    faults: list[str] = field(default_factory=list)


def start(work: Work, inputs: Path, out: Path, *more: str) -> subprocess.Popen[bytes]:
    """The command in a group of its own, in which an interrupt is not ignored."""
    # Where one file is written, its folder must be there.
    make_folder(out)
    # A file: a pipe would be held open by processes that go on.
    with (inputs / LOG).open("wb") as log:
        return subprocess.Popen(
        [*work.argv(inputs, out), *more], cwd=inputs, stdout=subprocess.DEVNULL,
        stderr=log, start_new_session=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip


def finish(work: Work, inputs: Path, out: Path, *more: str) -> float:
    """Run to the end; returns the seconds it took."""
    began = time.perf_counter()
    process = start(work, inputs, out, *more)
    process.wait(timeout=900)
    said = (inputs / LOG).read_text(encoding="utf-8")
    assert process.returncode == 0, f"exit status {process.returncode}: {said[-2000:]}"
    return time.perf_counter() - began


def kill(
    work: Work, inputs: Path, out: Path, moment: float, number: signal.Signals, whole: bool,
    tally: Tally,
) -> None:  # fmt: skip
    """Run the command and end it after so many seconds, alone or with its whole group."""
    before = leftovers(out)
    process = start(work, inputs, out)
    try:
        process.wait(timeout=moment)
        tally.ended += 1
        return
    except subprocess.TimeoutExpired:
        pass
    sent = time.perf_counter()
    (os.killpg if whole else os.kill)(process.pid, number)
    try:
        process.wait(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        tally.faults.append(f"{number.name} at {moment:.2f} s: has not ended in {PATIENCE} s")
    took = time.perf_counter() - sent
    tally.sent[number.name] += 1
    tally.slowest = max(tally.slowest, took)
    told = f"{number.name} at {moment:.2f} s, {'group' if whole else 'alone'}"
    if go_on(process.pid):
        if not (work.lingers and number is signal.SIGKILL):
            tally.faults.append(f"{told}: processes of it go on")
        os.killpg(process.pid, signal.SIGKILL)
    left = [path.name for path in leftovers(out) if path not in before]
    if number is not signal.SIGKILL and moment > BEGUN:
        said = (inputs / LOG).read_text(encoding="utf-8")
        faults = interrupted(process.returncode, number, said)
        tally.faults += [f"{told}: {fault}" for fault in faults + [f"leaves {n}" for n in left]]
    tally.temporary += len(left)
    for path in outputs(out):
        try:
            READERS[path.suffix](path)
        except Exception as error:
            tally.faults.append(f"{told}: {path.name} is half there, {error}")


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


def interrupted(status: int, number: int, err: str) -> list[str]:
    """What is wrong with how a command ended that was asked to end."""
    # Python tells of a signal that it leaves to nobody; else all was done and it was ending.
    late = status == -number == -signal.SIGINT
    faults = [] if late or status in (128 + number, 0) else [f"exit status {status}"]
    if "Traceback" in err or "Error" in err:
        faults.append(f"says {err[-600:]!r}")
    elif status == 130 and "interrupted" not in err and "go on" not in err:
        faults.append(f"says {err[-600:]!r}, not that it was interrupted")
    return faults


def repeat(
    work: Work, inputs: Path, out: Path, wanted: dict[str, bytes] | None, tally: Tally
) -> None:  # fmt: skip
    """Run again where kills have left what they left; the result must be as ever."""
    tally.again += 1
    goes_on = work.goes_on if (out / "checkpoint.zip").is_file() else ()
    try:
        if goes_on and tally.again % 2:
            finish(work, inputs, out, *goes_on)
            return
        finish(work, inputs, out)
    except AssertionError as error:
        tally.faults.append(f"run again: {error}")
        return
    found = contents(out)
    for name, content in (wanted or {}).items():
        if found.get(name) != content:
            tally.faults.append(f"run again: {name} differs")


def try_out(work: Work, kills: int, seed: int, every: int, folder: Path) -> Tally:
    """Kill a command so many times; after each `every` of them run it to its end.

    Args:
        work: the command.
        kills: how many.
        seed: of the moments.
        every: kills between two whole runs.
        folder: an empty one.
    """
    tally, rng = Tally(), np.random.default_rng(seed)
    inputs, out = folder / "inputs", folder / "out"
    recordings(inputs)
    seconds, wanted = 2.0, None
    if not work.endless:
        pair = [folder / "a", folder / "b"]
        # The first may compile; what differs between two undisturbed runs holds times.
        seconds = [finish(work, inputs, each) for each in pair][1]
        first, second = map(contents, pair)
        assert sorted(first) == sorted(second) and first
        wanted = {name: content for name, content in first.items() if second[name] == content}
    for k in range(kills):
        moment = float(rng.uniform(0.3, 1.02 * seconds))
        kill(work, inputs, out, moment, SIGNALS[k % 3], bool(rng.random() < 0.5), tally)
        if not work.endless and (k + 1) % every == 0:
            repeat(work, inputs, out, wanted, tally)
            shutil.rmtree(out)
    return tally


def main(
    works: Annotated[list[str] | None, typer.Argument(help=", ".join(WORKS))] = None,
    kills: Annotated[int, typer.Option(help="of each command")] = 50,
    seed: Annotated[int, typer.Option(help="of the moments")] = 1,
    every: Annotated[int, typer.Option(help="kills between two whole runs")] = 5,
) -> None:
    """Kill each of the commands, and tell what came of it."""
    failed = False
    for name in works or WORKS:
        with tempfile.TemporaryDirectory() as folder:
            tally = try_out(WORKS[name], kills, seed, every, Path(folder))
        failed = failed or bool(tally.faults)
        print(
            f"{name:12} {dict(tally.sent)}, {tally.ended} had ended, {tally.again} run again, "
            f"{tally.temporary} temporary files left, at most {tally.slowest:.1f} s to end; "
            f"{len(tally.faults)} faults",
            flush=True,
        )
        for fault in tally.faults:
            print(f"  {fault}", flush=True)
    raise typer.Exit(1 if failed else 0)


if __name__ == "__main__":
    typer.run(main)
