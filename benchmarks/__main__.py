"""All benchmarks, one after the other: `python -m benchmarks`, or `make bench`."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

SCRIPTS = (
    "integrator_speed",
    "environment_speed",
    "effects_speed",
    "effects_accuracy",
    "bifurcation_speed",
    "identification_speed",
)


def main() -> int:
    """Run every benchmark; the exit status is that of the first that fails."""
    folder = Path(__file__).parent
    for name in SCRIPTS:
        print(f"\n== {name} ==", flush=True)
        done = subprocess.run([sys.executable, str(folder / f"{name}.py")], check=False)
        if done.returncode:
            return done.returncode
    return 0


if __name__ == "__main__":
    sys.exit(main())
