"""What this process holds."""

from __future__ import annotations

import contextlib
import ctypes
from pathlib import Path


def memory() -> int:
    """Bytes of this process in memory; where that is unknown, the most it ever had.

    What is free is given back first: glibc may keep a hundred megabytes on top of its heap.
    """
    import resource

    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
        return pages * resource.getpagesize()
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
