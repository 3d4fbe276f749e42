"""The program that `apart` runs: reads a file, writes its columns as Arrow.

It is run by its path. Two empty modules stand for the package and its recordings, since all of
the package would take longer to import than most files to read.
"""

import json
import sys
from pathlib import Path
from types import ModuleType


def _read(kind: str, path: str, limits: str, wanted: str) -> int:
    for name, folder in (
        ("drill_env", Path(__file__).parents[1]),
        ("drill_env.recordings", Path(__file__).parent),
    ):
        module = ModuleType(name)
        module.__path__ = [str(folder)]
        sys.modules[name] = module
    from drill_env.recordings._read_apart import main

    return main(kind, Path(path), json.loads(limits), json.loads(wanted))


if __name__ == "__main__":
    sys.exit(_read(*sys.argv[1:]))
