"""Reading a recording: columns to channels, units to SI, and every check on the way."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from drill_env._errors import InputError, printable
from drill_env._types import FloatArray, PathLike
from drill_env.recordings.angles import check_angle
from drill_env.recordings.checks import (
    SHORTEST,
    Place,
    check_finite,
    check_huge,
    check_length,
    check_size,
    check_time,
    the_number,
)
from drill_env.recordings.clocks import on_rows
from drill_env.recordings.columns import (
    Column,
    ColumnMap,
    listed,
    missing_text,
    resolve,
    wanted_names,
)
from drill_env.recordings.drives import check_torque, check_voltage
from drill_env.recordings.recording import Recording, RecordingWarning
from drill_env.recordings.tables import Table, as_numbers, read_table
from drill_env.recordings.units import ANGLES, INERTIAS, VELOCITIES, Channel
from drill_env.recordings.velocities import check_velocity

Missing: TypeAlias = Literal["refuse", "keep"]


def read_recording(
    path: PathLike,
    column_map: ColumnMap | None = None,
    *,
    need: tuple[Channel, ...] = (),
    missing: Missing = "refuse",
    interpolate: bool = False,
) -> Recording:
    """Read one recording and check it.

    Row i holds the readings at t[i] and the voltage or torque held from t[i] to t[i+1]; with
    ``u=unknown`` in its place the upper disc's acceleration that its readings show.
    Each remark is issued as a `RecordingWarning` and kept in the recording's notes.

    Args:
        path: CSV, Parquet, MATLAB or JSON file, see the page on recordings.
        column_map: channel to "COLUMN" or "COLUMN:UNIT", see `parse_map`; channels not
            mapped are looked for under their own names.
        need: channels that must be there, besides t; a torque stands for u.
        missing: "refuse" values that are no number, or "keep" them: then an angle or velocity
            stays NaN, and rows without time, drive or load are left out.
        interpolate: a reading whose delay is no whole number of rows, between its samples.

    Raises:
        InputError: the file, a column or the time base is bad.
    """
    path = Path(path)
    table = read_table(path, wanted_names((column_map or {}).values()))
    return recording_from(
        printable(path), table, column_map, need=need, missing=missing, interpolate=interpolate
    )


def recording_from(
    source: str,
    table: Table,
    column_map: ColumnMap | None = None,
    *,
    need: tuple[Channel, ...] = (),
    missing: Missing = "refuse",
    interpolate: bool = False,
) -> Recording:
    """The recording that a table of the file `source` holds, as `read_recording` checks it."""
    found = tuple(table.columns)
    columns = resolve(source, found, column_map, table.others)
    there = {*columns, "u"} if "torque" in columns else {*columns}
    absent = [name for name in need if name not in there]
    if absent:
        raise InputError(missing_text(source, absent, found, table.others))
    moved = "u" in columns and columns["u"].unknown
    if moved:
        del columns["u"]
    check_length(table.columns[columns["t"].name], source)
    values, places = _channels(source, table, columns, missing)
    extra, ignored = _extra(source, table, columns)
    added = {
        name: the_number(values.pop(name), places[name]) for name in INERTIAS if name in values
    }
    notes = _without_missing(source, values, extra) if missing == "keep" else []
    checked, quanta = _checked(values, places)
    notes += checked + ignored + _two_drives(source, found, columns, column_map or {})
    torque = values.pop("torque", None)
    if torque is not None:
        values["u"] = torque
    counted = {name: 2.0 * math.pi / c.turn for name, c in columns.items() if c.turn}
    told: dict[str, Any] = {**values, **added}
    recording = Recording(
        **told, drive="voltage" if torque is None else "torque", extra=extra,
        constants=table.constants, quanta=quanta, stated=counted, source=source,
        columns=(*found, *table.constants), notes=tuple(notes),
    )  # fmt: skip
    recording = _shifted(recording, columns, interpolate=interpolate)
    if moved:
        recording = replace(recording, drive="motion")
    for note in recording.notes:
        warnings.warn(note, stacklevel=3)
    return recording


def _shifted(
    recording: Recording, columns: dict[Channel, Column], *, interpolate: bool
) -> Recording:
    """With each delayed channel where it belongs."""
    clocks: dict[Channel, tuple[FloatArray, FloatArray]] = {}
    for name, column in columns.items():
        if abs(column.delay) >= recording.duration:
            raise InputError(
                f"{recording.source}: the delay of {name}, {column.delay:g} s, is longer than the "
                "recording; give it in seconds"
            )
        if column.delay:
            channel: Channel = "u" if name == "torque" else name
            clocks[channel] = (recording.t - column.delay, recording.channel(channel))
    return on_rows(recording, clocks, interpolate=interpolate) if clocks else recording


def _two_drives(
    source: str, found: tuple[str, ...], columns: dict[Channel, Column], given: ColumnMap
) -> list[RecordingWarning]:
    unsaid = "u" not in given and "torque" not in columns
    if not ({"u", "torque"} <= set(found) and unsaid):
        return []
    text = (
        f"{source}: holds both u and torque; u is taken for the drive, say --map u=u, or "
        "--map torque=torque where the motor's torque was measured"
    )
    return [RecordingWarning("two_drives", text)]


def _channels(
    source: str, table: Table, columns: dict[Channel, Column], missing: Missing
) -> tuple[dict[Channel, FloatArray], dict[Channel, Place]]:
    values: dict[Channel, FloatArray] = {}
    places: dict[Channel, Place] = {}
    rows = len(table.columns[columns["t"].name])
    for name, column in columns.items():
        places[name] = Place(source, name, column, table.first_row)
        if column.constant is not None:
            values[name] = np.full(rows, column.constant)
            continue
        raw = table.columns[column.name]
        if len(raw) != rows:
            raise InputError(
                f"{places[name]} has {len(raw)} values and the time {rows}; make them equal"
            )
        numbers = as_numbers(raw, str(places[name]), table.first_row)
        (check_finite if missing == "refuse" else check_huge)(numbers, places[name])
        # The signed zeros of exported files would otherwise show in every difference.
        with np.errstate(over="ignore"):
            values[name] = numbers * column.scale + 0.0
        check_size(values[name], numbers, places[name])
    return values, places


def _without_missing(
    source: str, values: dict[Channel, FloatArray], extra: dict[str, FloatArray]
) -> list[RecordingWarning]:
    """Cut rows without time, drive or load out of both; the remark, if anything is missing."""
    read: list[Channel] = [name for name in (*ANGLES, *VELOCITIES) if name in values]
    absent = {name: ~np.isfinite(column) for name, column in values.items()}
    cut = np.any([absent[name] for name in values if name not in read], axis=0)
    some = np.any(list(absent.values()), axis=0)
    if not some.any():
        return []
    for name in values:
        values[name] = values[name][~cut]
    for name in extra:
        extra[name] = extra[name][~cut]
    check_length(values["t"], source)
    for name in read:
        values[name][~np.isfinite(values[name])] = np.nan
        if np.isfinite(values[name]).sum() < SHORTEST:
            raise InputError(f"{source}: {name} has no {SHORTEST} values; map another column")
    text = (
        f"{source}: {int(some.sum())} rows lack a value, {int(cut.sum())} of them the time, the "
        "drive or a load; these are left out, in the others the reading counts as not measured"
    )
    return [RecordingWarning("missing", text)]


def _checked(
    values: dict[Channel, FloatArray], places: dict[Channel, Place]
) -> tuple[list[RecordingWarning], dict[str, float]]:
    """Remarks and encoder steps; wrapped angles are unwrapped in `values`."""
    notes = check_time(values["t"], places["t"])
    if "u" in values and places["u"].column.constant is None:
        notes += check_voltage(values["u"], places["u"])
    if "torque" in values and places["torque"].column.constant is None:
        notes += check_torque(values["torque"], places["torque"])
    for name in VELOCITIES:
        if name in values:
            there = np.isfinite(values[name])
            notes += check_velocity(values[name][there], places[name])
    quanta: dict[str, float] = {}
    for name in ANGLES:
        if name in values:
            there = np.isfinite(values[name])
            theta, step, remarks = check_angle(
                values["t"][there], values[name][there], places[name]
            )
            values[name] = np.full_like(values["t"], np.nan)
            values[name][there] = theta
            notes += remarks
            if step is not None:
                quanta[name] = step
    return notes, quanta


def _extra(
    source: str, table: Table, columns: dict[Channel, Column]
) -> tuple[dict[str, FloatArray], list[RecordingWarning]]:
    used = {column.name for column in columns.values()}
    rows = len(table.columns[columns["t"].name])
    extra: dict[str, FloatArray] = {}
    ignored: list[str] = []
    for name, values in table.columns.items():
        if name in used:
            continue
        try:
            numbers = as_numbers(values, name)
        except InputError:
            ignored.append(name)
            continue
        if len(numbers) == rows:
            extra[name] = numbers
        else:
            ignored.append(name)
    if not ignored:
        return extra, []
    text = f"{source}: columns left out, not numeric or of another length: {listed(ignored)}"
    return extra, [RecordingWarning("ignored_column", text)]
