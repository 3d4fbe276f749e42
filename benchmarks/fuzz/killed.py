"""Long work that is killed: `python -m benchmarks.fuzz.killed [WORK...] --kills 50 --seed 1`.

Each command is ended at random moments by SIGKILL, SIGINT and SIGTERM in turn, sent to it alone or,
as a terminal does, to all its processes. Then no output may be half there, none of its processes
may go on, an interrupt is one line and exit status 130, and to run it again gives what it gives
when nothing happens.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from benchmarks.fuzz import left
from benchmarks.fuzz.preloaded import Preloaded, Process
from benchmarks.fuzz.works import ROOT, WORKS, Work, recordings
from drill_env._files import make_folder

SIGNALS = (signal.SIGKILL, signal.SIGINT, signal.SIGTERM)
LOG = "log"
BEGUN = 1.5
"""Seconds after which Python and the package are imported; before, an interrupt is Python's own."""
BEGUN_FORKED = 0.3
"""The same where all is imported already: measured 0.05 s on a quiet machine."""
PATIENCE = 60.0
"""Seconds within which a command must end after an interrupt, and its processes after it."""


@dataclass
class Tally:
    """What a command has gone through, and what was wrong."""

    sent: Counter[str] = field(default_factory=Counter)
    ended: int = 0
    again: int = 0
    temporary: int = 0
    slowest: float = 0.0
    faults: list[str] = field(default_factory=list)


Begin = Callable[[Sequence[str], Path, Path], Process]


def cold(argv: Sequence[str], folder: Path, log: Path) -> Process:
    """Start Python anew, in a session of its own, in which an interrupt is not ignored."""
    # A file: a pipe would be held open by processes that go on.
    with log.open("wb") as stream:
        return subprocess.Popen(
            argv, cwd=folder, stdout=subprocess.DEVNULL, stderr=stream, start_new_session=True,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        )  # fmt: skip


@dataclass(frozen=True)
class Trial:
    """A command under trial.

    Attributes:
        work: the command.
        inputs: folder of its inputs, where it runs and its log lies.
        out: folder of its outputs.
        tally: what came of it.
        begin: begins a command, given its folder and its log.
        begun: seconds after which an interrupt is the package's own.
        wanted: what a whole run leaves, by name.
        last: the output that a whole run writes last, nothing where it has no end.
    """

    work: Work
    inputs: Path
    out: Path
    tally: Tally = field(default_factory=Tally)
    begin: Begin = cold
    begun: float = BEGUN
    wanted: Mapping[str, bytes] = field(default_factory=dict)
    last: str = ""

    def start(self, out: Path, *more: str) -> Process:
        """Begin it."""
        # Where one file is written, its folder must be there.
        make_folder(out)
        argv = [*self.work.argv(self.inputs, out), *more]
        return self.begin(argv, self.inputs, self.inputs / LOG)

    def said(self) -> str:
        """Its standard error."""
        return (self.inputs / LOG).read_text(encoding="utf-8")


def finish(trial: Trial, out: Path, *more: str) -> float:
    """Run to the end; returns the seconds to its last output.

    What follows, a third of a short run, is Python taking its modules apart.
    """
    began = time.time()
    status = trial.start(out, *more).wait(timeout=900)
    assert status == 0, f"exit status {status}: {trial.said()[-2000:]}"
    return max(path.stat().st_mtime for path in left.outputs(out)) - began


def kill(trial: Trial, moment: float, number: signal.Signals, whole: bool) -> None:
    """Run the command and end it after so many seconds, alone or with its whole group."""
    out, tally = trial.out, trial.tally
    before, began = left.leftovers(out), time.time()
    process = trial.start(out)
    try:
        process.wait(timeout=moment)
        tally.ended += 1
        return
    except subprocess.TimeoutExpired:
        pass
    told = f"{number.name} at {moment:.2f} s, {'group' if whole else 'alone'}"
    sent = time.perf_counter()
    (os.killpg if whole else os.kill)(process.pid, number)
    try:
        status = process.wait(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        status = process.wait()
        tally.faults.append(f"{told}: has not ended in {PATIENCE} s")
    tally.sent[number.name] += 1
    tally.slowest = max(tally.slowest, time.perf_counter() - sent)
    if left.go_on(process.pid):
        if not (trial.work.lingers and number is signal.SIGKILL):
            tally.faults.append(f"{told}: processes of it go on")
        os.killpg(process.pid, signal.SIGKILL)
    stayed = [path.name for path in left.leftovers(out) if path not in before]
    tally.temporary += len(stayed)
    faults = left.broken(out)
    if number is not signal.SIGKILL and moment > trial.begun:
        # What an earlier run has left may be kept: the last output alone tells that all is done.
        late = number is signal.SIGINT or left.since(out / trial.last, began)
        faults += left.interrupted(status, number, trial.said(), late=late)
        faults += [f"leaves {name}" for name in stayed]
    tally.faults += [f"{told}: {fault}" for fault in faults]


def repeat(trial: Trial) -> None:
    """Run again where kills have left what they left; the result must be as ever."""
    out, tally = trial.out, trial.tally
    tally.again += 1
    goes_on = trial.work.goes_on if (out / "checkpoint.zip").is_file() else ()
    try:
        if goes_on and tally.again % 2:
            finish(trial, out, *goes_on)
            return
        finish(trial, out)
    except AssertionError as error:
        tally.faults.append(f"run again: {error}")
        return
    found = left.contents(out)
    for name, content in trial.wanted.items():
        if found.get(name) != content:
            tally.faults.append(f"run again: {name} differs")


def undisturbed(trial: Trial, folder: Path) -> tuple[float, dict[str, bytes]]:
    """Seconds that it takes, and what it leaves each time; what differs holds times."""
    pair = [folder / "a", folder / "b"]
    # The first may compile, and tells what is to be imported ahead.
    seconds = [finish(trial, each) for each in pair][1]
    first, second = map(left.contents, pair)
    assert sorted(first) == sorted(second) and first
    return seconds, {name: content for name, content in first.items() if second[name] == content}


def try_out(trial: Trial, kills: int, seed: int, every: int) -> Tally:
    """Kill a command so many times; after each `every` of them run it to its end.

    Args:
        trial: the command with empty folders.
        kills: how many; runs that end before their moment come on top, as many at most.
        seed: of the moments.
        every: kills between two whole runs.
    """
    tally, rng = trial.tally, np.random.default_rng(seed)
    recordings(trial.inputs)
    seconds = 2.0
    if not trial.work.endless:
        seconds, wanted = undisturbed(trial, trial.inputs.parent)
        trial = replace(trial, wanted=wanted, last=left.last(trial.inputs.parent / "b"))
    for _ in range(2 * kills):
        moment = float(rng.uniform(0.2 * trial.begun, max(1.02 * seconds, trial.begun)))
        number = SIGNALS[tally.sent.total() % 3]
        kill(trial, moment, number, bool(rng.random() < 0.5))
        done = tally.sent.total()
        if trial.wanted and done // every > tally.again:
            repeat(trial)
            shutil.rmtree(trial.out)
        if done == kills:
            break
    return tally


def tried(name: str, kills: int, seed: int, every: int, *, anew: bool) -> Tally:
    """Try one out in temporary folders.

    Args:
        name: of the work.
        kills: how many.
        seed: of the moments.
        every: kills between two whole runs.
        anew: whether each run is a new Python; else a fork of one that has imported what it needs.
    """
    with tempfile.TemporaryDirectory() as folder:
        inputs, out, work = Path(folder) / "inputs", Path(folder) / "out", WORKS[name]
        if anew or work.endless:
            return try_out(Trial(work, inputs, out), kills, seed, every)
        with Preloaded(Path(folder)) as ready:
            trial = Trial(work, inputs, out, begin=ready.start, begun=BEGUN_FORKED)
            return try_out(trial, kills, seed, every)


def main(
    works: Annotated[list[str] | None, typer.Argument(help=", ".join(WORKS))] = None,
    kills: Annotated[int, typer.Option(help="of each command")] = 50,
    seed: Annotated[int, typer.Option(help="of the moments")] = 1,
    every: Annotated[int, typer.Option(help="kills between two whole runs")] = 5,
    anew: Annotated[bool, typer.Option(help="start Python for each run")] = False,
) -> None:
    """Kill each of the commands, and tell what came of it."""
    failed = False
    for name in works or WORKS:
        tally = tried(name, kills, seed, every, anew=anew)
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
