"""TOML and JSON files: those of people and other programs read without trust, ours written."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from drill_env._errors import InputError

MOST_BYTES = 20_000_000
"""Bytes of a TOML or JSON file. The largest that is written here is an estimate of all recordings
of a folder: some hundred, of a kilobyte each. A measured curve of a rig file, at 40 bytes a knot,
may have half a million."""


def read_toml(path: Path, what: str, remedy: str) -> dict[str, Any]:
    """The contents of a TOML file.

    Args:
        path: the file.
        what: how messages call it.
        remedy: what to do if it is no TOML.

    Raises:
        InputError: it is missing, no TOML, too large, or holds a number that no float holds.
    """
    return _read(path, what, "TOML", remedy, tomllib.loads)


def read_json(path: Path, what: str, remedy: str) -> Any:
    """The contents of a JSON file; arguments and errors as `read_toml`."""
    return _read(path, what, "JSON", remedy, json.loads)


def _read(path: Path, what: str, kind: str, remedy: str, parse: Callable[[str], Any]) -> Any:
    try:
        with path.open("rb") as stream:
            content = stream.read(MOST_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{what}: {reason}; check the path") from error
    if len(content) > MOST_BYTES:
        raise InputError(f"{what} has more than {MOST_BYTES:.0e} bytes; {remedy}")
    try:
        # As if read as text: either line end may stand.
        document = parse(content.decode("utf-8").replace("\r\n", "\n"))
        _check_numbers(document, "")
    except RecursionError as error:
        raise InputError(f"{what} is not {kind} (nested too deeply); {remedy}") from error
    except InputError as error:
        raise InputError(f"{what}: {error}") from error
    except ValueError as error:
        raise InputError(f"{what} is not {kind} ({error}); {remedy}") from error
    return document


def _check_numbers(value: Any, name: str) -> None:
    """Refuse whole numbers beyond all floats, which every later use would trip over."""
    if isinstance(value, dict):
        for key, item in value.items():
            _check_numbers(item, f"{name}.{key}" if name else str(key))
    elif isinstance(value, list):
        for item in value:
            _check_numbers(item, name)
    elif isinstance(value, int):
        try:
            float(value)
        except OverflowError:
            raise InputError(f"{name} is a number of more than 308 digits; correct it") from None


def plain(value: Any) -> Any:
    """Values as JSON has them: no arrays, paths, NaN or infinity."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value if value is None or isinstance(value, (bool, int, float, str)) else str(value)
