"""How a program and its workers end when they are told to."""

from __future__ import annotations

import functools
import os
import signal
import sys
import threading
import time
from typing import Any

_LOOK = 0.5
"""Seconds between two looks at the parent; a worker that is left alone ends as soon."""


def end_tidily() -> None:
    """Let the first SIGTERM unwind the program, as an interrupt does; the second ends it at once.

    Temporary files are then removed and worker processes ended; exit status 143.
    """
    signal.signal(signal.SIGTERM, _unwind)


def _unwind(number: int, _frame: Any) -> None:
    signal.signal(number, signal.SIG_DFL)
    if threading.main_thread().is_alive():
        sys.exit(128 + number)
    # All is done and Python is ending: an exception in what it still calls would be a traceback.
    signal.raise_signal(number)


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
