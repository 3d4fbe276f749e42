"""Rig files: TOML with one table [rig], keyed by the paper's symbols in SI units."""

from __future__ import annotations

import tomllib
from dataclasses import fields
from pathlib import Path
from typing import Any

import tomli_w

from drill_env._errors import InputError
from drill_env._files import write_text
from drill_env._types import PathLike
from drill_env.parameters.rig import SYMBOLS, Rig

_OPTIONS = ("friction", "clamp", "inertias")
_UPPER = ("km", "Ju", "Tsu", "dTsu", "bu", "dbu")
_UNUSED = {"humped": (), "stribeck": ("T2", "beta2"), "coulomb": ("T1", "T2", "beta1", "beta2")}


def load_rig(path: PathLike) -> Rig:
    """Read a rig file.

    Args:
        path: TOML file with a table ``[rig]`` and, optionally, ``[[effects]]``.

    Raises:
        InputError: the file is missing, is no TOML, or a key is missing, unknown or bad.
    """
    path = Path(path)
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"rig file {path}: {error.strerror}; check the path") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(
            f"rig file {path} is not TOML ({error}); `drill-env rig show` prints a valid one"
        ) from error
    table = document.get("rig")
    if not isinstance(table, dict):
        raise InputError(f"rig file {path} has no table [rig]; `drill-env rig show` prints one")
    extra = sorted(set(document) - {"rig", "effects"})
    if extra:
        raise InputError(f"rig file {path}: unknown top-level key {extra[0]}; known: rig, effects")
    effects = document.get("effects", [])
    if not isinstance(effects, list) or not all(isinstance(e, dict) for e in effects):
        raise InputError(f"rig file {path}: write effects as tables, [[effects]]")
    try:
        return _from_table(table, tuple(effects))
    except InputError as error:
        raise InputError(f"rig file {path}: {error}") from error


def _from_table(table: dict[str, Any], effects: tuple[dict[str, Any], ...]) -> Rig:
    unknown = sorted(set(table) - set(SYMBOLS) - set(_OPTIONS))
    if unknown:
        raise InputError(f"unknown key {unknown[0]}; known: {' '.join((*SYMBOLS, *_OPTIONS))}")
    if not isinstance(table.get("clamp", False), bool):
        raise InputError(f"clamp is {table['clamp']!r}: give true or false")
    one = table.get("inertias", 2) == 1
    unused = _UNUSED.get(str(table.get("friction", "humped")), ())
    needed = _UPPER if one else tuple(s for s in SYMBOLS if s not in unused)
    missing = [name for name in needed if name not in table]
    if missing:
        raise InputError(
            f"missing key {', '.join(missing)}; start from the output of `drill-env rig show`"
        )
    if one:
        return Rig.one_inertia(**{name: table[name] for name in _UPPER})
    return Rig(**{"beta1": 1.0, "beta2": 1.0, "T1": 0.0, "T2": 0.0, **table}, effects=effects)


def dump_rig(rig: Rig) -> str:
    """The text of a rig file, with each unit as a comment."""
    units = {f.name: f.metadata for f in fields(Rig) if f.metadata}
    keys = _UPPER if rig.inertias == 1 else SYMBOLS
    width = max(len(f"{name} = {getattr(rig, name)!r}") for name in keys)
    lines = ["[rig]"]
    for name in keys:
        entry = f"{name} = {getattr(rig, name)!r}"
        note = units[name]["meaning"] if rig.inertias == 1 else _note(units[name])
        lines.append(f"{entry:<{width}}  # {note}")
    if rig.inertias == 1:
        lines.append("inertias = 1")
    else:
        lines.append(f'friction = "{rig.friction}"')
        if rig.clamp:
            lines.append("clamp = true")
    text = "\n".join(lines) + "\n"
    if rig.effects:
        text += "\n" + tomli_w.dumps({"effects": [dict(e) for e in rig.effects]})
    return text


def _note(metadata: Any) -> str:
    return f"{metadata['unit']}: {metadata['meaning']}"


def save_rig(rig: Rig, path: PathLike) -> None:
    """Write a rig file; `load_rig` reads back an equal rig."""
    write_text(Path(path), dump_rig(rig))
