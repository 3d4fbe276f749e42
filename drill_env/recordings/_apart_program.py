"""The program that `apart` runs: reads a file, writes its columns as Arrow.

It is run by its path. Two empty modules stand for the package and its recordings, since all of
the package would take longer to import than most files to read.
"""

import json
import sys
from pathlib import Path
from types import ModuleType

for _name, _folder in (
    ("drill_env", Path(__file__).parents[1]),
    ("recordings", Path(__file__).parent),
):
    _module = ModuleType(_name if _name == "drill_env" else f"drill_env.{_name}")
    _module.__path__ = [str(_folder)]
    sys.modules[_module.__name__] = _module

from drill_env.recordings._read_apart import main  # noqa: E402

_kind, _path, _limits, _wanted = sys.argv[1:]
sys.exit(main(_kind, Path(_path), json.loads(_limits), json.loads(_wanted)))
