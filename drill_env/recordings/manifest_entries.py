"""What the manifest of a folder says of each recording."""

from __future__ import annotations

import datetime as dt
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args

from drill_env._checks import real
from drill_env._documents import read_toml
from drill_env._errors import InputError
from drill_env.recordings.dates import date_of, date_told
from drill_env.recordings.manifest_checks import check_choice, check_counts, check_delay, check_keys
from drill_env.recordings.read import Missing
from drill_env.recordings.units import CHANNELS, COUNTED, DRIVES, GIVEN, INERTIAS, NUMBERED, Channel

MANIFEST = "recordings.toml"
Role: TypeAlias = Literal["stage1", "fit", "holdout"]
ROLES: tuple[Role, ...] = get_args(Role)
_OPTIONS = (
    "columns",
    "units",
    "counts_per_rev",
    "closed_loop",
    "missing",
    "date",
    "note",
    "delay",
    "interpolate",
    "effects",
    *INERTIAS,
)


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
        files: channel to its file, where each has one of its own.
        delay: channel to how long before its row's time a value belongs, s.
        interpolate: see `drill_env.recordings.read_recording`.
        effects: known physics of this recording alone.
    """

    role: Role = "fit"
    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    counts_per_rev: float | None = None
    closed_loop: bool = False
    missing: Missing = "refuse"
    date: dt.date | None = None
    note: str = ""
    files: Mapping[Channel, Path] = field(default_factory=dict)
    delay: Mapping[str, float] = field(default_factory=dict)
    interpolate: bool = False
    effects: tuple[Mapping[str, Any], ...] = ()


def column_map(entry: RecordingSettings, names: Mapping[str, str]) -> dict[Channel, str]:
    """Channel to "COLUMN[:UNIT][@DELAY]" by what a manifest says.

    Args:
        entry: what it says.
        names: channel to column.
    """
    columns: dict[Channel, str] = {}
    for channel in CHANNELS:
        unit = entry.units.get(channel)
        delay = 0.0 if entry.files else entry.delay.get(channel, 0.0)
        if unit is not None and unit == COUNTED.get(channel):
            unit = f"counts/{entry.counts_per_rev:g}"
        if channel in names or unit is not None or delay:
            text = names.get(channel, channel) + ("" if unit is None else f":{unit}")
            columns[channel] = f"{text}@{delay!r}" if delay else text
    return columns


def shown(path: Path) -> bool:
    """Whether it is a file that is not hidden: a program that was killed may leave such."""
    return path.is_file() and not path.name.startswith(".")


def from_manifest(manifest: Path) -> dict[Path, RecordingSettings]:
    """What a manifest says, by the file of each recording.

    Raises:
        InputError: a key, role, unit or file of it is bad.
    """
    document = read_toml(manifest, str(manifest), "mend that line")
    check_keys(f"{manifest}", document, ("defaults", "recording"))
    defaults, entries = document.get("defaults", {}), document.get("recording", [])
    if not isinstance(defaults, dict):
        raise InputError(f"{manifest}: defaults is no table; write [defaults]")
    if (
        not isinstance(entries, list)
        or not entries
        or not all(isinstance(e, dict) for e in entries)
    ):
        raise InputError(f"{manifest}: no recordings; write one table [[recording]] for each")
    check_keys(f"{manifest}: [defaults]", defaults, ("role", *_OPTIONS))
    found: dict[Path, RecordingSettings] = {}
    for number, entry in enumerate(entries, 1):
        where = f"{manifest}: [[recording]] number {number}"
        check_keys(where, entry, ("file", "files", "role", *_OPTIONS))
        several = _several(where, manifest.parent, entry)
        # By the name of the first reading's file: those of time, drive and load may be shared.
        first = [file for name, file in several.items() if name not in ("t", *GIVEN)][:1]
        for file in first or _files(where, manifest.parent, entry.get("file")):
            if file in found:
                raise InputError(f"{where}: {file.name} is named before; keep one of the two")
            told = _settings(f"{manifest}: {file.name}", defaults, entry)
            found[file] = replace(told, date=told.date or date_of(file.name), files=several)
    return found


def _several(where: str, folder: Path, entry: Mapping[str, Any]) -> dict[Channel, Path]:
    """The file of each channel, in the order of the channels; none where one file holds all."""
    if "files" not in entry:
        return {}
    files = entry["files"]
    if "file" in entry or not isinstance(files, dict):
        raise InputError(
            f'{where}: give either file = "NAME" or files = {{ u = "NAME", theta_u = "NAME" }}'
        )
    check_keys(f"{where}: files", files, tuple(c for c in CHANNELS if c not in INERTIAS))
    if not set(files) - {"t", *GIVEN} or set(DRIVES) <= set(files):
        raise InputError(f"{where}: files needs one of a reading, theta_u or such, and one drive")
    found: dict[Channel, Path] = {}
    for channel in CHANNELS:
        if channel in files:
            matching = _files(where, folder, files[channel])
            if len(matching) > 1:
                raise InputError(f"{where}: files.{channel} matches {len(matching)}; name one")
            found[channel] = matching[0]
    return found


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
    merged = {
        **defaults,
        **{key: value for key, value in entry.items() if key not in ("file", "files")},
    }
    for key in ("columns", "units"):
        tables = (defaults.get(key, {}), entry.get(key, {}))
        if not all(isinstance(table, dict) for table in tables):
            raise InputError(f'{where}: {key} is no table; write {key} = {{ u = "…" }}')
        merged[key] = {**tables[0], **tables[1]}
        check_keys(f"{where}: {key}", merged[key], CHANNELS)
        for channel, text in merged[key].items():
            if key == "columns" and channel in NUMBERED and type(text) in (int, float):
                merged[key][channel] = repr(text)
            elif not isinstance(text, str) or not text:
                raise InputError(f"{where}: {key}.{channel} is {text!r}; write a name in quotes")
    for name in INERTIAS:
        if name in merged:
            merged["columns"][name] = repr(real(merged.pop(name), f"{where}: {name}"))
    check_choice(where, "role", merged.setdefault("role", "fit"), ROLES)
    check_choice(where, "missing", merged.setdefault("missing", "refuse"), get_args(Missing))
    flags = (("closed_loop", bool, "true or false"), ("interpolate", bool, "true or false"))
    for key, kind, wanted in (*flags, ("note", str, "a text")):
        if key in merged and not isinstance(merged[key], kind):
            raise InputError(f"{where}: {key} is {merged[key]!r}; give {wanted}")
    if "date" in merged:
        merged["date"] = date_told(where, merged["date"])
    check_counts(where, merged)
    check_delay(where, merged.setdefault("delay", {}))
    return RecordingSettings(**merged)
