"""Independent work on several threads: compiled kernels leave the interpreter free."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

A = TypeVar("A")
B = TypeVar("B")

PROCESSORS = os.cpu_count() or 1
"""How many items are worked on at once."""

_here = threading.local()


def each(job: Callable[[A], B], items: Iterable[A], threads: int | None = None) -> list[B]:
    """What a job gives for each item, in their order.

    Within such a job the items of another call follow one another: the processors are taken.

    Args:
        job: what is done.
        items: with what.
        threads: at once, `PROCESSORS` by default.
    """
    items, threads = list(items), threads or PROCESSORS
    if min(len(items), threads) < 2 or getattr(_here, "taken", False):
        return [job(item) for item in items]
    with ThreadPoolExecutor(threads, initializer=_take) as pool:
        return list(pool.map(job, items))


def on_one_thread(job: Callable[..., B], *arguments: Any) -> B:
    """What a job gives while its items follow one another: other processes have the processors."""
    before = getattr(_here, "taken", False)
    _take()
    try:
        return job(*arguments)
    finally:
        _here.taken = before


def _take() -> None:
    _here.taken = True
