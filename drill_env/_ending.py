"""How a program and its workers end when they are told to."""

from __future__ import annotations

import contextlib
import functools
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from typing import Any

_LOOK = 0.5
"""Seconds between two looks at the parent; a worker that is left alone ends as soon."""


@contextlib.contextmanager
def ending_tidily() -> Iterator[None]:
    """Let the first SIGTERM unwind the program, as an interrupt does; the second ends it at once.

    Temporary files are then removed and worker processes ended; exit status 143. After the block
    all is done: an exception in what Python still calls would be a traceback, so that either
    signal then ends the process at once.
    """
    signal.signal(signal.SIGTERM, _unwind)
    try:
        yield
    finally:
        for number in (signal.SIGTERM, signal.SIGINT):
            # What whoever began this wants ignored stays ignored.
            if signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, signal.SIG_DFL)


def _unwind(number: int, _frame: Any) -> None:
    signal.signal(number, signal.SIG_DFL)
    sys.exit(128 + number)


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Processes that are begun in the block never see an interrupt: who began them ends them.

    One that comes meanwhile is this process's own after the block.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    former = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, former)


@functools.cache
def end_with(parent: int) -> None:
    """End this worker when its parent is gone, which may have been killed without a word.

    Args:
        parent: number of the process that gives the work; nothing is done if that is this one.
    """
    if parent == os.getpid():
        return

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_LOOK)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
