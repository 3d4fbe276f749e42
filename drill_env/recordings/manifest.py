"""A folder of recordings, with a small manifest that tells what each file is for."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType

from drill_env._errors import InputError, printable
from drill_env._types import PathLike
from drill_env.recordings.columns import Channel, listed, missing_text
from drill_env.recordings.dates import date_of
from drill_env.recordings.files import read_files
from drill_env.recordings.manifest_entries import (
    MANIFEST,
    ROLES,
    RecordingSettings,
    Role,
    column_map,
    from_manifest,
    shown,
)
from drill_env.recordings.read import read_recording
from drill_env.recordings.recording import Recording, RecordingWarning

# Not .json: estimates and reports are that too, and a manifest names what is a recording.
_KINDS = (
    ".csv", ".csv.gz", ".txt", ".tsv", ".parquet", ".pq", ".mat",
    ".jsonl", ".jsonl.gz", ".ndjson", ".ndjson.gz",
)  # fmt: skip
# Files of each role begin so.
_BEGINNINGS: dict[str, Role] = {"stage1": "stage1", "fit": "fit", "hold": "holdout"}


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


def read_folder(
    path: PathLike,
    progress: Callable[[int, int], None] | None = None,
    columns: Mapping[Channel, str] | None = None,
) -> RecordingSet:
    """Read every recording that the folder's `recordings.toml` names.

    Without a manifest files named stage1*, fit* or hold* have that role and all others are
    fitted; a `RecordingWarning` says so. A date in a file's name, as 2026-01-31, counts.

    Args:
        path: the folder, or its manifest.
        progress: called with the number of files read so far and in all.
        columns: of all files of a folder without a manifest, as `parse_map` gives them.

    Raises:
        InputError: a key, role, unit or file of the manifest is bad, or a recording is; or there
            are `columns` beside a manifest.
    """
    path = Path(path)
    folder = path.parent if path.name == MANIFEST else path
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; give a folder of recordings")
    manifest = folder / MANIFEST
    if manifest.is_file():
        if columns:
            raise InputError(f"{manifest} is there: put what --map says under columns in it")
        settings = from_manifest(manifest)
    else:
        settings = _from_names(folder, columns or {})
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
    if entry.files:
        recording = read_files(file, entry)
    else:
        columns = column_map(entry, entry.columns)
        recording = read_recording(
            file, columns, need=("u",), missing=entry.missing, interpolate=entry.interpolate
        )
    if entry.effects:
        recording = replace(recording, effects=entry.effects)
    if entry.role == "stage1" and recording.theta_u is None and recording.omega_u is None:
        raise InputError(missing_text(str(file), ("theta_u",), recording.columns))
    if not recording.readings():
        raise InputError(
            f"{file}: neither theta_u nor theta_l, nor a velocity omega_u or omega_l; found: "
            f"{listed(recording.columns)}. Name one under columns in {MANIFEST}"
        )
    return recording


def _from_names(folder: Path, columns: Mapping[Channel, str]) -> dict[Path, RecordingSettings]:
    files = sorted(f for f in folder.iterdir() if f.name.lower().endswith(_KINDS) and shown(f))
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
    names: dict[str, str] = {**columns}
    return {f: RecordingSettings(role, names, date=date_of(f.name)) for f, role in roles.items()}


def _role_by_name(name: str) -> Role:
    for beginning, role in _BEGINNINGS.items():
        if name.lower().startswith(beginning):
            return role
    return "fit"
