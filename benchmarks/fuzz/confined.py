"""One harness in a process with bounded memory."""

from __future__ import annotations

import os
import sys
import traceback
from pathlib import Path

from benchmarks.fuzz.harnesses import HARNESSES
from benchmarks.fuzz.judge import MOST_GROWN, fuzz
from drill_env.recordings import limits


def _confine() -> None:
    import resource

    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + limits.MOST_MEMORY + 2**30
    resource.setrlimit(resource.RLIMIT_AS, (most, most))


def run(name: str, folder: Path, count: int, seed: int, first: int) -> None:
    """Fuzz one reader and print what came of it; exit status 1 where an input failed."""
    if sys.platform == "linux":
        _confine()
    began = os.times()
    try:
        tally = fuzz(HARNESSES[name], folder, count, seed, first)
    except BaseException:
        traceback.print_exc()
        sys.exit(1)
    spent = sum(os.times()[:4]) - sum(began[:4])
    print(
        f"{name:12} {tally.tried} inputs, {tally.accepted} accepted, {len(tally.reasons)} kinds of "
        f"error, slowest {tally.slowest:.2f} s, grown by {tally.grown / 2**20:.0f} MB, "
        f"{tally.tried / spent:.0f} inputs per s of CPU",
        flush=True,
    )
    if tally.grown > MOST_GROWN:
        sys.exit(1)
