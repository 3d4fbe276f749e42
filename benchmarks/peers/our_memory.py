"""Script: bytes per environment of our vector environment, as JSON on stdout."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

import drill_env  # noqa: F401


def resident_bytes() -> int | None:
    """Memory of this process in RAM, where the system tells."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:
        return None
    import resource

    return pages * resource.getpagesize()


def make(count: int) -> Any:
    env: Any = gym.make_vec(
        "DrillString-v0", num_envs=count, vectorization_mode="vector_entry_point", truth=False
    )
    env.reset(seed=0)
    env.step(np.zeros((count, 1), dtype=np.float32))
    return env


def main() -> None:
    # The first one pays for imports and compiled code; all are kept, so that none is reused.
    kept = [make(1)]
    out = []
    for count in (1024, 4096, 16384):
        before = resident_bytes()
        kept.append(make(count))
        after = resident_bytes()
        grown = None if before is None or after is None else (after - before) / count
        arrays = sum(array.nbytes for array in kept[-1]._core.rows)
        out.append({"envs": count, "arrays": arrays / count, "resident": grown})
    print(json.dumps(out))


if __name__ == "__main__":
    main()
