"""What the manifest of a folder says of each recording."""

from __future__ import annotations

import datetime as dt
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, TypeAlias, cast, get_args

from drill_env._documents import read_toml
from drill_env._errors import InputError
from drill_env.recordings.columns import (
    CHANNELS,
    COUNTED,
    DRIVES,
    UNITS,
    Channel,
    counts_per_turn,
    number_of,
)
from drill_env.recordings.dates import date_of, date_told
from drill_env.recordings.read import Missing

MANIFEST = "recordings.toml"
Role: TypeAlias = Literal["stage1", "fit", "holdout"]
ROLES: tuple[Role, ...] = get_args(Role)
_OPTIONS = ("columns", "units", "counts_per_rev", "closed_loop", "missing", "date", "note")


@dataclass(frozen=True, slots=True)
class RecordingSettings:
    """What a manifest says of one recording.

    Attributes:
        role: what it is for.
        columns: channel to column, as given.
        units: channel to unit, as given.
        counts_per_rev: encoder counts per revolution, None if not given.
        closed_loop: the voltage came from a controller that saw the angles.
        missing: see `drill_env.recordings.read_recording`.
        date: of the recording, from its file's name where the manifest says nothing, or None.
        note: free text.
    """

    role: Role = "fit"
    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    counts_per_rev: float | None = None
    closed_loop: bool = False
    missing: Missing = "refuse"
    date: dt.date | None = None
    note: str = ""


def shown(path: Path) -> bool:
    """Whether it is a file that is not hidden: a program that was killed may leave such."""
    return path.is_file() and not path.name.startswith(".")


def from_manifest(manifest: Path) -> dict[Path, RecordingSettings]:
    """What a manifest says, by the file of each recording.

    Raises:
        InputError: a key, role, unit or file of it is bad.
    """
    document = read_toml(manifest, str(manifest), "mend that line")
    _check_keys(f"{manifest}", document, ("defaults", "recording"))
    defaults, entries = document.get("defaults", {}), document.get("recording", [])
    if not isinstance(defaults, dict):
        raise InputError(f"{manifest}: defaults is no table; write [defaults]")
    if (
        not isinstance(entries, list)
        or not entries
        or not all(isinstance(e, dict) for e in entries)
    ):
        raise InputError(f"{manifest}: no recordings; write one table [[recording]] for each")
    _check_keys(f"{manifest}: [defaults]", defaults, ("role", *_OPTIONS))
    found: dict[Path, RecordingSettings] = {}
    for number, entry in enumerate(entries, 1):
        where = f"{manifest}: [[recording]] number {number}"
        _check_keys(where, entry, ("file", "role", *_OPTIONS))
        for file in _files(where, manifest.parent, entry.get("file")):
            if file in found:
                raise InputError(f"{where}: {file.name} is named before; keep one of the two")
            told = _settings(f"{manifest}: {file.name}", defaults, entry)
            found[file] = replace(told, date=told.date or date_of(file.name))
    return found


def _check_keys(where: str, table: Mapping[str, Any], known: tuple[str, ...]) -> None:
    unknown = sorted(set(table) - set(known))
    if unknown:
        raise InputError(f"{where}: unknown key {unknown[0]}; known: {', '.join(known)}")


def _files(where: str, folder: Path, pattern: Any) -> list[Path]:
    if not isinstance(pattern, str) or not pattern:
        raise InputError(f'{where}: no file; write file = "NAME.csv", or a pattern such as fit-*')
    if Path(pattern).is_absolute():
        raise InputError(f"{where}: file {pattern} is absolute; give it relative to the manifest")
    plain = folder / pattern
    try:
        files = [plain] if plain.is_file() else [f for f in folder.glob(pattern) if shown(f)]
    except (OSError, ValueError, NotImplementedError) as error:
        raise InputError(f"{where}: file {pattern!r} is no name or pattern ({error})") from error
    files = sorted(_inside(where, folder, f) for f in files)
    files = [f for f in files if f.name != MANIFEST]
    if not files:
        raise InputError(f"{where}: no file {plain}; check the name")
    return files


def _inside(where: str, folder: Path, file: Path) -> Path:
    """The file, unless a `..` leads out of the manifest's folder."""
    if ".." in file.relative_to(folder).parts:
        raise InputError(f"{where}: file {file} lies outside the folder; move it inside")
    return file


def _settings(
    where: str, defaults: Mapping[str, Any], entry: Mapping[str, Any]
) -> RecordingSettings:
    merged = {**defaults, **{key: value for key, value in entry.items() if key != "file"}}
    for key in ("columns", "units"):
        tables = (defaults.get(key, {}), entry.get(key, {}))
        if not all(isinstance(table, dict) for table in tables):
            raise InputError(f'{where}: {key} is no table; write {key} = {{ u = "…" }}')
        merged[key] = {**tables[0], **tables[1]}
        _check_keys(f"{where}: {key}", merged[key], CHANNELS)
        for channel, text in merged[key].items():
            if key == "columns" and channel in DRIVES and type(text) in (int, float):
                merged[key][channel] = repr(text)
            elif not isinstance(text, str) or not text:
                raise InputError(f"{where}: {key}.{channel} is {text!r}; write a name in quotes")
    _check_choice(where, "role", merged.setdefault("role", "fit"), ROLES)
    _check_choice(where, "missing", merged.setdefault("missing", "refuse"), get_args(Missing))
    for key, kind, wanted in (("closed_loop", bool, "true or false"), ("note", str, "a text")):
        if key in merged and not isinstance(merged[key], kind):
            raise InputError(f"{where}: {key} is {merged[key]!r}; give {wanted}")
    if "date" in merged:
        merged["date"] = date_told(where, merged["date"])
    _check_counts(where, merged)
    return RecordingSettings(**merged)


def _check_choice(where: str, key: str, value: Any, known: tuple[str, ...]) -> None:
    if value not in known:
        raise InputError(f"{where}: unknown {key} {value!r}; known: {', '.join(known)}")


def _check_counts(where: str, merged: Mapping[str, Any]) -> None:
    counts = merged.get("counts_per_rev")
    good = isinstance(counts, (int, float)) and not isinstance(counts, bool) and 1 <= counts < 1e12
    if counts is not None and not good:
        raise InputError(f"{where}: counts_per_rev is {counts!r}; give a number of 1 or more")
    for channel, unit in merged["units"].items():
        counted = COUNTED.get(cast(Channel, channel))
        if unit == counted:
            if counts is None:
                raise InputError(
                    f'{where}: units.{channel} is "{unit}" but counts_per_rev is not given; add it'
                )
        elif unit not in UNITS[cast(Channel, channel)] and not number_of(unit):
            if counted and counts_per_turn(unit):
                continue
            names = [*UNITS[cast(Channel, channel)], *([counted, "counts/N"] if counted else [])]
            raise InputError(
                f"{where}: unknown unit {unit!r} of {channel}; known: {', '.join(names)}, or a "
                "number to multiply by"
            )
