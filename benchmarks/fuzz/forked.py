"""Work in a process of its own, which may crash or hang."""

from __future__ import annotations

import multiprocessing
import warnings
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any


def _answer(work: Callable[[], dict[str, Any]], end: Connection) -> None:
    warnings.simplefilter("ignore")
    end.send(work())
    end.close()


def forked(work: Callable[[], dict[str, Any]], seconds: float) -> dict[str, Any]:
    """What `work` returns; `fault` is "hang" after so many seconds, "crash" where it dies."""
    context = multiprocessing.get_context("fork")
    here, there = context.Pipe(duplex=False)
    worker = context.Process(target=_answer, args=(work, there))
    worker.start()
    there.close()
    try:
        found = here.recv() if here.poll(seconds) else {"fault": "hang", "detail": "given up"}
    except EOFError:
        found = {"fault": "crash"}
    worker.kill()
    worker.join()
    return found
