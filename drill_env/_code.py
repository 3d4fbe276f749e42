"""Whether the code that made a result is still the same."""

from __future__ import annotations

import functools
import hashlib
from pathlib import Path

_ROOT = Path(__file__).resolve().parent


@functools.cache
def digest_of_code(*names: str) -> str:
    """Hash of parts of this package, to keep beside what they computed.

    Args:
        names: files, and folders with the Python and JSON files right in them, by their path
            inside the package.
    """
    digest = hashlib.sha256()
    for name in names:
        for path in _files(_place(name)):
            digest.update(f"{name}/{path.name}\n".encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()


def _place(name: str) -> Path:
    if name in ("agents", "baselines"):
        # In a checkout they lie beside the package.
        import importlib

        return Path(str(importlib.import_module(f"drill_env.{name}").__file__)).parent
    return _ROOT / name


def _files(place: Path) -> list[Path]:
    if place.is_file():
        return [place]
    found = [path for ending in ("py", "json") for path in place.glob(f"*.{ending}")]
    if not found:
        raise FileNotFoundError(f"no code in {place}")
    return sorted(found)
