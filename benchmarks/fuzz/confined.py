"""One harness in a process with bounded memory."""

from __future__ import annotations

import sys
import time
import traceback
from pathlib import Path

from benchmarks.fuzz.harnesses import HARNESSES
from benchmarks.fuzz.judge import fuzz
from drill_env.recordings import limits


def _confine() -> None:
    import resource

    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + limits.MOST_MEMORY + 2**30
    resource.setrlimit(resource.RLIMIT_AS, (most, most))


def run(name: str, folder: Path, count: int, seed: int) -> None:
    """Fuzz one reader and print what came of it; exit status 1 where an input failed."""
    if sys.platform == "linux":
        _confine()
    began = time.perf_counter()
    try:
        tally = fuzz(HARNESSES[name], folder, count, seed)
    except BaseException:
        traceback.print_exc()
        sys.exit(1)
    print(
        f"{name:12} {tally.tried} inputs, {tally.accepted} accepted, {len(tally.reasons)} kinds of "
        f"error, slowest {tally.slowest:.2f} s, in all {time.perf_counter() - began:.0f} s",
        flush=True,
    )
