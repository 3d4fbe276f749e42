"""Work in a process of its own, which may crash or hang."""

from __future__ import annotations

import math
import multiprocessing
import resource
import signal
import warnings
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

# A machine that is busy otherwise gives a process no more than a share of a core.
_BUSY = 100.0


def _answer(work: Callable[[], dict[str, Any]], seconds: float, end: Connection) -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(seconds), math.ceil(seconds) + 1))
    warnings.simplefilter("ignore")
    end.send(work())
    end.close()


def forked(work: Callable[[], dict[str, Any]], seconds: float) -> dict[str, Any]:
    """What `work` returns; `fault` is "hang" after so many CPU seconds, "crash" where it dies."""
    context = multiprocessing.get_context("fork")
    here, there = context.Pipe(duplex=False)
    worker = context.Process(target=_answer, args=(work, seconds, there))
    worker.start()
    there.close()
    try:
        found = here.recv() if here.poll(_BUSY * seconds) else {"fault": "hang", "detail": "asleep"}
    except EOFError:
        worker.join()
        ended = worker.exitcode in (-signal.SIGXCPU, -signal.SIGKILL)
        found = {"fault": "hang", "detail": "CPU limit"} if ended else {"fault": "crash"}
    worker.kill()
    worker.join()
    return found
