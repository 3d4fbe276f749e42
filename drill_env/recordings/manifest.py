"""A folder of recordings, with a small manifest that tells what each file is for."""

from __future__ import annotations

import datetime as dt
import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, TypeAlias, cast, get_args

from drill_env._documents import read_toml
from drill_env._errors import InputError, printable
from drill_env._types import PathLike
from drill_env.recordings.columns import (
    CHANNELS,
    COUNTED,
    UNITS,
    Channel,
    counts_per_turn,
    listed,
    missing_text,
)
from drill_env.recordings.dates import date_of, date_told
from drill_env.recordings.read import Missing, read_recording
from drill_env.recordings.recording import Recording, RecordingWarning

MANIFEST = "recordings.toml"
Role: TypeAlias = Literal["stage1", "fit", "holdout"]
ROLES: tuple[Role, ...] = get_args(Role)

_KINDS = (".csv", ".csv.gz", ".txt", ".tsv", ".parquet", ".pq", ".mat")
_OPTIONS = ("columns", "units", "counts_per_rev", "closed_loop", "missing", "date", "note")
# Files of each role begin so.
_BEGINNINGS: dict[str, Role] = {"stage1": "stage1", "fit": "fit", "hold": "holdout"}


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


@dataclass(frozen=True, slots=True, eq=False)
class RecordingSet:
    """Recordings by what they are for, in the order of the manifest or of their names.

    Attributes:
        stage1: of the upper disc alone.
        fit: of the whole rig, to be fitted.
        holdout: of the whole rig, to judge by.
        settings: what the manifest says, by `Recording.source`.
    """

    stage1: tuple[Recording, ...] = ()
    fit: tuple[Recording, ...] = ()
    holdout: tuple[Recording, ...] = ()
    settings: Mapping[str, RecordingSettings] = field(default_factory=lambda: MappingProxyType({}))

    def of(self, recording: Recording) -> RecordingSettings:
        """The settings of one recording, defaults where none were given."""
        return self.settings.get(recording.source, RecordingSettings())


def read_folder(path: PathLike, progress: Callable[[int, int], None] | None = None) -> RecordingSet:
    """Read every recording that the folder's `recordings.toml` names.

    Without a manifest files named stage1*, fit* or hold* have that role and all others are
    fitted; a `RecordingWarning` says so. A date in a file's name, as 2026-01-31, counts.

    Args:
        path: the folder, or its manifest.
        progress: called with the number of files read so far and in all.

    Raises:
        InputError: a key, role, unit or file of the manifest is bad, or a recording is.
    """
    path = Path(path)
    folder = path.parent if path.name == MANIFEST else path
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; give a folder of recordings")
    manifest = folder / MANIFEST
    settings = _from_manifest(manifest) if manifest.is_file() else _from_names(folder)
    groups: dict[Role, list[Recording]] = {role: [] for role in ROLES}
    for number, (file, entry) in enumerate(settings.items(), 1):
        groups[entry.role].append(_read(file, entry))
        if progress is not None:
            progress(number, len(settings))
    return RecordingSet(
        *(tuple(groups[role]) for role in ROLES),
        settings=MappingProxyType({printable(file): entry for file, entry in settings.items()}),
    )


def _read(file: Path, entry: RecordingSettings) -> Recording:
    columns: dict[Channel, str] = {}
    for channel in CHANNELS:
        unit = entry.units.get(channel)
        if unit is not None and unit == COUNTED.get(channel):
            unit = f"counts/{entry.counts_per_rev:g}"
        if channel in entry.columns or unit is not None:
            name = entry.columns.get(channel, channel)
            columns[channel] = name if unit is None else f"{name}:{unit}"
    recording = read_recording(file, columns, need=("u",), missing=entry.missing)
    if entry.role == "stage1" and recording.theta_u is None and recording.omega_u is None:
        raise InputError(missing_text(str(file), ("theta_u",), recording.columns))
    if not recording.readings():
        raise InputError(
            f"{file}: neither theta_u nor theta_l, nor a velocity omega_u or omega_l; found: "
            f"{listed(recording.columns)}. Name one under columns in {MANIFEST}"
        )
    return recording


def _shown(path: Path) -> bool:
    """Whether it is a file that is not hidden: a program that was killed may leave such."""
    return path.is_file() and not path.name.startswith(".")


def _from_names(folder: Path) -> dict[Path, RecordingSettings]:
    files = sorted(f for f in folder.iterdir() if f.name.lower().endswith(_KINDS) and _shown(f))
    if not files:
        raise InputError(
            f"{folder}: no recordings ({', '.join(_KINDS)}) and no {MANIFEST}; "
            "give the folder that holds them"
        )
    roles: dict[Path, Role] = {f: _role_by_name(f.name) for f in files}
    counts = ", ".join(f"{list(roles.values()).count(role)} {role}" for role in ROLES)
    text = (
        f"{folder}: no {MANIFEST}, so roles are taken from the file names (stage1*, fit*, "
        f"hold*; fit otherwise): {counts}"
    )
    warnings.warn(RecordingWarning("no_manifest", text), stacklevel=3)
    return {f: RecordingSettings(role, date=date_of(f.name)) for f, role in roles.items()}


def _role_by_name(name: str) -> Role:
    for beginning, role in _BEGINNINGS.items():
        if name.lower().startswith(beginning):
            return role
    return "fit"


def _from_manifest(manifest: Path) -> dict[Path, RecordingSettings]:
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
        files = [plain] if plain.is_file() else [f for f in folder.glob(pattern) if _shown(f)]
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
            if not isinstance(text, str) or not text:
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
        elif unit not in UNITS[cast(Channel, channel)] and not _is_number(unit):
            if counted and counts_per_turn(unit):
                continue
            names = [*UNITS[cast(Channel, channel)], *([counted, "counts/N"] if counted else [])]
            raise InputError(
                f"{where}: unknown unit {unit!r} of {channel}; known: {', '.join(names)}, or a "
                "number to multiply by"
            )


def _is_number(text: str) -> bool:
    try:
        return float(text) != 0.0 and math.isfinite(float(text))
    except ValueError:
        return False
