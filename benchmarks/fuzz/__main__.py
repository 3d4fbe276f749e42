"""Fuzz readers: `python -m benchmarks.fuzz [READER...] --inputs 100000 --seed 1`.

Each reader runs in a process of its own, confined to the memory that docs/security.md states and
one gigabyte more; a crash of it is a failure, and the file that did it is kept.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import tempfile
from pathlib import Path

from benchmarks.fuzz.confined import run
from benchmarks.fuzz.harnesses import HARNESSES


def main() -> int:
    """Run the named readers, all by default; 1 if one of them failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("readers", nargs="*", metavar="READER", help=", ".join(HARNESSES))
    parser.add_argument("--inputs", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first input")
    args = parser.parse_args()
    unknown = sorted(set(args.readers) - set(HARNESSES))
    if unknown:
        parser.error(f"unknown reader {unknown[0]}; known: {', '.join(HARNESSES)}")
    failed = []
    for name in args.readers or HARNESSES:
        folder = Path(tempfile.mkdtemp(prefix=f"fuzz-{name}-"))
        # Threads that others have started would not survive a fork.
        context = multiprocessing.get_context("spawn")
        given = (name, folder, args.inputs, args.seed, args.first)
        process = context.Process(target=run, args=given)
        process.start()
        process.join()
        if process.exitcode:
            failed.append(name)
            print(f"{name}: FAILED, exit status {process.exitcode}; its files: {folder}")
    print(f"failed: {', '.join(failed) or 'none'}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
