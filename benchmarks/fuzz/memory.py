"""What this process holds."""

from __future__ import annotations

from pathlib import Path


def memory() -> int:
    """Bytes of this process in memory; where that is unknown, the most it ever had."""
    import resource

    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
        return pages * resource.getpagesize()
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
