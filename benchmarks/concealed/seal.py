"""Answers that cannot be changed after the run: their SHA-256 is published before it."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from drill_env._errors import InputError
from drill_env._files import write_text

NAME = "seal.json"


def digest(path: Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def write_seal(folder: Path, command: str) -> str:
    """Seal every answer in a folder.

    Returns:
        SHA-256 of the seal itself, the one line to publish.
    """
    answers = {path.name: digest(path) for path in sorted(folder.glob("[0-9]*.json"))}
    document = {"schema": 1, "command": command, "answers": answers}
    write_text(folder / NAME, json.dumps(document, indent=1) + "\n")
    return digest(folder / NAME)


def open_answers(folder: Path, published: str | None = None) -> dict[str, dict[str, Any]]:
    """Answers by number, once they are seen to be those that were sealed.

    Args:
        folder: of the answers and their seal.
        published: SHA-256 of the seal as it was published; not compared if None.

    Raises:
        InputError: an answer was changed, added or removed after it was sealed.
    """
    path = folder / NAME
    if not path.exists():
        raise InputError(f"{folder} has no {NAME}: give the folder that `make` wrote answers to")
    if published is not None and digest(path) != published:
        raise InputError(f"{path} is not the seal that was published ({published})")
    sealed = json.loads(path.read_text(encoding="utf-8"))["answers"]
    present = {p.name for p in folder.glob("[0-9]*.json")}
    if present != set(sealed):
        odd = sorted(present ^ set(sealed))[0]
        raise InputError(f"{folder / odd} was added or removed after the answers were sealed")
    found = {}
    for name, expected in sealed.items():
        if digest(folder / name) != expected:
            raise InputError(f"{folder / name} was changed after it was sealed")
        found[Path(name).stem] = json.loads((folder / name).read_text(encoding="utf-8"))
    return found
