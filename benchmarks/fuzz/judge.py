"""One input, one verdict: read, or refused by one printable line; soon, and in bounded memory."""

from __future__ import annotations

import faulthandler
import signal
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from drill_env import InputError

LONGEST = 5.0
"""Seconds for one input."""


@dataclass(frozen=True)
class Harness:
    """A reader with what it is fed.

    Attributes:
        name: of the reader.
        inputs: strategy of what it is given.
        read: takes a folder for files and one input, reads it, and asserts that what was accepted
            is sane.
        prepare: what is done once before the clock runs, such as compiling.
    """

    name: str
    inputs: st.SearchStrategy[Any]
    read: Callable[[Path, Any], None]
    prepare: Callable[[], None] = lambda: None


@dataclass
class Tally:
    """What a harness has seen."""

    tried: int = 0
    accepted: int = 0
    slowest: float = 0.0
    reasons: set[str] = field(default_factory=set)


class Hang(Exception):
    """An input took longer than allowed."""


def _hang(*_: Any) -> None:
    raise Hang(f"more than {LONGEST} s")


def fuzz(harness: Harness, folder: Path, count: int, start: int) -> Tally:
    """Feed `count` inputs; the first that fails is shrunk by hypothesis and raised.

    Args:
        harness: the reader.
        folder: an empty folder for its files.
        count: inputs.
        start: seed.
    """
    tally = Tally()

    @seed(start)
    @settings(
        max_examples=count, database=None, deadline=None, suppress_health_check=list(HealthCheck),
        phases=(Phase.generate, Phase.shrink), report_multiple_bugs=False,
    )  # fmt: skip
    @given(harness.inputs)
    def one(given_input: Any) -> None:
        judged(harness, folder, given_input, tally)

    harness.prepare()
    one()
    return tally


def judged(harness: Harness, folder: Path, given_input: Any, tally: Tally) -> None:
    """Read one input; any error but the package's own goes on."""
    begin = time.perf_counter()
    former = signal.signal(signal.SIGALRM, _hang)
    signal.setitimer(signal.ITIMER_REAL, LONGEST)
    # Compiled code that never comes back cannot be interrupted, only ended.
    faulthandler.dump_traceback_later(12.0 * LONGEST, exit=True)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            harness.read(folder, given_input)
        tally.accepted += 1
    except InputError as error:
        text = str(error)
        assert text and text.isprintable() and len(text) <= 2001, text
        tally.reasons.add("".join(c for c in text[-60:] if c.isalpha() or c == " "))
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, former)
        faulthandler.cancel_dump_traceback_later()
        tally.tried += 1
        tally.slowest = max(tally.slowest, time.perf_counter() - begin)
