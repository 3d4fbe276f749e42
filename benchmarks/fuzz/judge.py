"""One input, one verdict: read, or refused by one printable line; soon, and in bounded memory."""

from __future__ import annotations

import contextlib
import faulthandler
import re
import signal
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.fuzz.dice import Dice
from benchmarks.fuzz.memory import memory
from drill_env import InputError

LONGEST = 5.0
"""Seconds of CPU for one input: on a busy machine any input may wait."""
LONGEST_WAIT = 600.0
"""Seconds within which the next input must come: what waits for ever takes no CPU."""
MOST_GROWN = 2**26
"""Bytes by which a reader may grow after the first tenth of its inputs: pages of the allocator and
of the libraries; where 10 000 inputs kept what they were, 10 kB each, it would be more."""

_NO_LETTERS = re.compile(r"[^a-zA-Z ]+")
MOST_REASONS = 10_000
"""Kinds of error that are distinguished: the count would else be what grows."""


@dataclass(frozen=True)
class Harness:
    """A reader with what it is fed.

    Attributes:
        name: of the reader.
        inputs: draws one.
        read: takes a folder for files and one input, reads it, and asserts that what was accepted
            is sane.
        prepare: what is done once before the clock runs, such as compiling.
    """

    name: str
    inputs: Callable[[Dice], Any]
    read: Callable[[Path, Any], None]
    prepare: Callable[[], None] = lambda: None


@dataclass
class Tally:
    """What a harness has seen."""

    tried: int = 0
    accepted: int = 0
    slowest: float = 0.0
    grown: int = 0
    reasons: set[str] = field(default_factory=set)


class Hang(Exception):
    """An input took longer than allowed."""


class Failed(AssertionError):
    """An input was neither read nor refused as it should be."""


def _hang(*_: Any) -> None:
    raise Hang(f"more than {LONGEST} s")


@contextlib.contextmanager
def watched() -> Iterator[None]:
    """Set once for all inputs, since setting it costs more than many a reader."""
    former = signal.signal(signal.SIGPROF, _hang)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, former)
        faulthandler.cancel_dump_traceback_later()


def fuzz(harness: Harness, folder: Path, count: int, seed: int, first: int = 0) -> Tally:
    """Feed `count` inputs; the first that fails is raised with the number that makes it again.

    Args:
        harness: the reader.
        folder: an empty folder for its files.
        count: inputs.
        seed: of them all.
        first: number of the first.
    """
    tally, size, armed = Tally(), 0, 0.0
    harness.prepare()
    with watched():
        for number in range(first, first + count):
            if time.monotonic() > armed + 1.0:
                # Compiled code that never comes back cannot be interrupted, only ended.
                faulthandler.dump_traceback_later(LONGEST_WAIT, exit=True)
                armed = time.monotonic()
            given = harness.inputs(Dice(seed, number))
            try:
                judged(harness, folder, given, tally)
            except BaseException as error:
                words = f"{harness.name}, seed {seed}, input {number}: {given!r:.2000}"
                raise Failed(words) from error
            if tally.tried == count // 10:
                size = memory()
    tally.grown = memory() - size
    return tally


def judged(harness: Harness, folder: Path, given: Any, tally: Tally) -> None:
    """Read one input; any error but the package's own goes on."""
    begin = time.process_time()
    signal.setitimer(signal.ITIMER_PROF, LONGEST)
    try:
        harness.read(folder, given)
        tally.accepted += 1
    except InputError as error:
        text = str(error)
        assert text and text.isprintable() and len(text) <= 2001, text
        if len(tally.reasons) < MOST_REASONS:
            tally.reasons.add(_NO_LETTERS.sub("", text[-60:]))
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        tally.tried += 1
        tally.slowest = max(tally.slowest, time.process_time() - begin)
