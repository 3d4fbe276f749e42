"""One recording out of several files, one for each channel."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from drill_env._errors import InputError, printable
from drill_env._types import FloatArray
from drill_env.recordings.clocks import on_rows
from drill_env.recordings.columns import (
    listed,
    missing_text,
    number_of,
    wanted_names,
)
from drill_env.recordings.manifest_entries import MANIFEST, RecordingSettings, column_map
from drill_env.recordings.prescribed import UNKNOWN
from drill_env.recordings.read import recording_from
from drill_env.recordings.recording import Recording
from drill_env.recordings.tables import Table, Values, read_table
from drill_env.recordings.units import DRIVES, GIVEN, NUMBERED, Channel


def read_files(source: Path, entry: RecordingSettings) -> Recording:
    """The channels of several files on the rows of the reading that has most samples.

    A file has its own column of the time, or as many rows as the file of `t`.

    Args:
        source: the file that the recording is named after.
        entry: names the file of each channel, and how it is read.

    Raises:
        InputError: a file is bad, holds no such column or time, or the clocks do not fit.
    """
    parts: dict[Channel, Recording] = {
        name: _part(name, file, entry) for name, file in entry.files.items() if name != "t"
    }
    readings: list[Channel] = [name for name in parts if name not in GIVEN]
    main: Channel = max(readings, key=lambda name: len(parts[name]))
    drive = parts[main].drive
    others: dict[Channel, tuple[FloatArray, FloatArray]] = {}
    for name, part in parts.items():
        channel: Channel = "u" if name == "torque" else name
        if name != main:
            others[channel] = (part.t - entry.delay.get(name, 0.0), part.channel(channel))
        if name in DRIVES:
            drive = part.drive
    moved = entry.columns.get("u") == UNKNOWN and set(DRIVES).isdisjoint(parts)
    if "u" not in others and parts[main].u is None and not moved:
        raise InputError(
            f"{source}: no file of u; add it to files in {MANIFEST}, or columns.u = 0, or "
            f'columns.u = "{UNKNOWN}"'
        )
    rows = _named_after(source, parts, main)
    rows = replace(rows, t=rows.t - entry.delay.get(main, 0.0), drive=drive)
    whole = on_rows(rows, others, interpolate=entry.interpolate)
    for note in whole.notes[len(rows.notes) :]:
        warnings.warn(note, stacklevel=2)
    return replace(whole, drive="motion") if moved else whole


def _named_after(source: Path, parts: Mapping[Channel, Recording], main: Channel) -> Recording:
    """The recording of the main reading, with what is known of all channels."""
    every = parts.values()
    return replace(
        parts[main], source=printable(source), extra={},
        quanta={name: step for part in every for name, step in part.quanta.items()},
        stated={name: step for part in every for name, step in part.stated.items()},
        columns=tuple(dict.fromkeys(name for part in every for name in part.columns)),
        notes=tuple(note for part in every for note in part.notes),
    )  # fmt: skip


def _part(channel: Channel, file: Path, entry: RecordingSettings) -> Recording:
    """One channel and its time as a recording of its own, with all checks."""
    names = dict(entry.columns)
    table = read_table(file, wanted_names(names.values()))
    time = _present(names.get("t", "t"), table)
    name = _present(names.get(channel, channel), table)
    if name is None and channel not in names:
        name = _only(table, time)
    if name is None:
        wanted = names.get(channel, channel)
        raise InputError(missing_text(str(file), (wanted,), tuple(table.columns), table.others))
    values = table.columns[name]
    if time is None:
        time, clock = _clock(file, len(values), entry)
        time = "t" if time == name else time
    else:
        clock = table.columns[time]
    told = column_map(entry, {**names, "t": time, channel: name})
    kept: dict[Channel, str] = {"t": told["t"], channel: told[channel]}
    for given in NUMBERED:
        if given not in entry.files and number_of(names.get(given, "")) is not None:
            kept[given] = told[given]
    return recording_from(
        printable(file), replace(table, columns={time: clock, name: values}), kept,
        need=(channel,), missing=entry.missing,
    )  # fmt: skip


def _clock(file: Path, rows: int, entry: RecordingSettings) -> tuple[str, Values]:
    """Name and values of the time in the file of `t`."""
    name, clock = entry.columns.get("t", "t"), entry.files.get("t")
    if clock is None:
        raise InputError(
            f"{file}: no column {name} of its time; name it under columns, or a file of t under "
            f"files in {MANIFEST}"
        )
    table = read_table(clock, [name])
    found = _present(name, table)
    if found is None and "t" not in entry.columns:
        found = _only(table, None)
    if found is None:
        raise InputError(
            f"{clock}: no column {name}; found: {listed([*table.columns, *table.others])}. "
            f"Name it under columns in {MANIFEST}"
        )
    if len(table.columns[found]) != rows:
        raise InputError(
            f"{file} has {rows} rows and {clock.name} {len(table.columns[found])}; make them "
            "equal, or give each file a time of its own"
        )
    return found, table.columns[found]


def _present(text: str, table: Table) -> str | None:
    return text if text in table.columns else None


def _only(table: Table, time: str | None) -> str | None:
    """The only column beside the time."""
    names = [name for name in table.columns if name != time]
    return names[0] if len(names) == 1 else None
