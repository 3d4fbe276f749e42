"""Who is told while kernels are compiled: nobody, unless asked. Imports no compiler."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import NamedTuple

_DRAWN_ANEW = "\r\033[K"
_SILENT = 2.0
"""Seconds after which a log, which cannot draw a line anew, gets one."""


class Compiling(NamedTuple):
    """How far the compilation of one kernel, and of all that it calls, has come.

    Attributes:
        done: kernels that are compiled.
        total: kernels in all.
        name: the one at work.
        finished: whether the first kernel itself is compiled.
    """

    done: int
    total: int
    name: str
    finished: bool


_observers: list[Callable[[Compiling], None]] = []
_spent = [0.0]


def observe(observer: Callable[[Compiling], None]) -> None:
    """Call `observer` whenever a kernel begins and when a whole compilation has ended."""
    _observers.append(observer)


def announce(state: Compiling) -> None:
    """Tell all observers."""
    for observer in _observers:
        observer(state)


def add_seconds(seconds: float) -> None:
    """Count CPU seconds that a compilation took."""
    _spent[0] += seconds


def spent() -> float:
    """CPU seconds that all compilations of this process have taken."""
    return _spent[0]


class Lines:
    """Writes progress to stderr: one line drawn anew on a terminal, a single one into a log."""

    def __init__(self) -> None:
        self._begun = 0.0
        self._told = False

    def __call__(self, state: Compiling) -> None:
        """Write what `state` says."""
        if sys.stderr.isatty():
            text = f"compiling kernel {state.done + 1} of {state.total}: {state.name} (only once)"
            sys.stderr.write(_DRAWN_ANEW + ("" if state.finished else text))
            sys.stderr.flush()
            return
        self._begun = self._begun or time.monotonic()
        if not self._told and time.monotonic() - self._begun > _SILENT:
            self._told = True
            print("first call on this machine: compiling, once ...", file=sys.stderr)
