"""How a program ends when it is told to."""

from __future__ import annotations

import signal
import sys
from typing import Any


def end_tidily() -> None:
    """Let the first SIGTERM unwind the program, as an interrupt does; the second ends it at once.

    Temporary files are then removed and worker processes ended; exit status 143.
    """
    signal.signal(signal.SIGTERM, _unwind)


def _unwind(number: int, _frame: Any) -> None:
    signal.signal(number, signal.SIG_DFL)
    sys.exit(128 + number)
