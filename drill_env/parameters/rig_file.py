"""Rig files: TOML with one table [rig], keyed by the paper's symbols in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import tomli_w

from drill_env._documents import read_toml
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
    document = read_toml(path, f"rig file {path}", "`drill-env rig show` prints a valid one")
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
    # TOML's true and 1.0 equal 1 in Python.
    if type(table.get("inertias", 2)) is not int:
        raise InputError(f"inertias is {table['inertias']!r}: give 1 (upper disc alone) or 2")
    one = table.get("inertias", 2) == 1
    unused = _UNUSED.get(str(table.get("friction", "humped")), ())
    needed = _UPPER if one else tuple(s for s in SYMBOLS if s not in unused)
    missing = [name for name in needed if name not in table]
    if missing:
        raise InputError(
            f"missing key {', '.join(missing)}; start from the output of `drill-env rig show`"
        )
    if one:
        if table.get("ktheta", 0) != 0:
            raise InputError("ktheta is given with inertias = 1, which has no string: remove it")
        alone = Rig.one_inertia(**{name: table[name] for name in _UPPER})
        return alone.replace(**table, effects=effects)
    return Rig(**{"beta1": 1.0, "beta2": 1.0, "T1": 0.0, "T2": 0.0, **table}, effects=effects)


def dump_rig(rig: Rig) -> str:
    """The text of a rig file, with each unit as a comment."""
    units = {f.name: f.metadata for f in fields(Rig) if f.metadata}
    one = rig.inertias == 1
    bare = Rig.one_inertia(km=1.0, Ju=1.0, Tsu=0.0, bu=0.0) if one else None
    keys = [n for n in SYMBOLS if n in _UPPER or not one or getattr(rig, n) != getattr(bare, n)]
    width = max(len(f"{name} = {getattr(rig, name)!r}") for name in keys)
    lines = ["[rig]"]
    for name in keys:
        entry = f"{name} = {getattr(rig, name)!r}"
        note = units[name]["meaning"] if one else _note(units[name])
        lines.append(f"{entry:<{width}}  # {note}")
    if bare is None or rig.friction != bare.friction:
        lines.append(f'friction = "{rig.friction}"')
    if one:
        lines.append("inertias = 1")
    if rig.clamp:
        lines.append("clamp = true")
    return "\n".join(lines) + "\n" + "".join(_effect_text(effect) for effect in rig.effects)


def _effect_text(effect: Mapping[str, Any]) -> str:
    # As a table of its own: tomli_w would write short lists of tables inline, which after
    # [rig] would become one of its keys.
    body = tomli_w.dumps({"effects": dict(effect)}).removeprefix("[effects]\n")
    return f"\n[[effects]]\n{body}"


def _note(metadata: Any) -> str:
    return f"{metadata['unit']}: {metadata['meaning']}"


def save_rig(rig: Rig, path: PathLike) -> None:
    """Write a rig file; `load_rig` reads back an equal rig."""
    write_text(Path(path), dump_rig(rig))
