"""A fleet: every rig of a folder, resumable, in one table."""

from __future__ import annotations

import functools
import os
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from drill_env._engine import SERIAL, Engine, Progress, TaskError, outcomes
from drill_env._errors import InputError
from drill_env._files import make_folder, replacing
from drill_env._tables import write_table
from drill_env.fleet.rig import RigAnswer, RigTask, diagnose_rig
from drill_env.fleet.row import SCHEMA
from drill_env.fleet.settings import FleetSettings, rig_folders
from drill_env.report.diagnosis_files import write_diagnosis


@dataclass(frozen=True, slots=True, eq=False)
class Fleet:
    """A fleet that was diagnosed.

    Attributes:
        rows: one a rig, with the columns of `drill_env.fleet.row.SCHEMA`.
        files: the tables that were written.
        kept: rigs that were done before.
        faults: rigs whose diagnosis failed for no fault of their files.
        stale: parts of rigs that are not in the folder any more.
    """

    rows: tuple[dict[str, Any], ...]
    files: tuple[Path, ...]
    kept: tuple[str, ...]
    faults: tuple[str, ...]
    stale: tuple[str, ...]

    @property
    def table(self) -> pd.DataFrame:
        """The rows as a table; the name of a rig is `rig`."""
        whole = pa.Table.from_pylist(list(self.rows), SCHEMA)
        return whole.to_pandas().rename(columns={"name": "rig"})


def run_fleet(
    folder: Path, out: Path, settings: FleetSettings | None = None, *,
    engine: Engine = SERIAL, progress: Progress | None = None,
) -> Fleet:  # fmt: skip
    """Diagnose every rig that is not done yet; can be interrupted and resumed.

    Args:
        folder: one folder for each rig, as `drill_env.recordings.read_folder` reads it, with a
            `rig.toml` if the rig is known. With Ray every machine must see it.
        out: gets `rigs/NAME` with the report of each, `parts/rig=NAME/part.parquet` with its row,
            and the table as `fleet.csv` and `fleet.parquet`. This process alone writes there.
        settings: of the diagnosis.
        engine: where the rigs are diagnosed.
        progress: called with (done, total).

    Raises:
        InputError: there are no folders, or `out` cannot be written or lies among them.
    """
    settings = settings or FleetSettings()
    rigs = rig_folders(folder.resolve())
    if any(out.resolve().is_relative_to(rig) for rig in rigs):
        raise InputError(f"--out {out} lies in a rig's folder: choose another place")
    if folder.resolve() == out.resolve():
        raise InputError(f"--out {out} is the folder of the rigs: choose another place")
    make_folder(out)
    before = {rig.name: _done_before(out, rig.name) for rig in rigs}
    tasks = [RigTask(rig, (before[rig.name] or {}).get("digest")) for rig in rigs]
    found = outcomes(
        functools.partial(diagnose_rig, settings=settings), tasks, engine,
        name=lambda task: task.folder.name, progress=progress,
    )  # fmt: skip
    rows: list[dict[str, Any]] = []
    kept, faults = [], []
    with closing(found):
        for rig, outcome in zip(rigs, found, strict=True):
            if outcome is None:
                kept.append(rig.name)
            elif isinstance(outcome, TaskError) and not outcome.bad_input:
                faults.append(rig.name)
            rows.append((before[rig.name] or {}) if outcome is None else _keep(out, rig, outcome))
    files = (out / "fleet.csv", out / "fleet.parquet")
    fleet = Fleet(tuple(rows), files, tuple(kept), tuple(faults), _stale(out, rigs))
    write_table(fleet.table.drop(columns=["parameters", "digest"]), files[0])
    write_table(fleet.table, files[1])
    return fleet


def _place(out: Path, name: str) -> Path:
    # Readers take what follows `rig=` as a quoted name.
    return out / "parts" / f"rig={quote(name, safe=' ')}" / "part.parquet"


def _done_before(out: Path, name: str) -> dict[str, Any] | None:
    """The row of a rig that was diagnosed and whose report is there."""
    path = _place(out, name)
    if not (path.is_file() and (out / "rigs" / name / "diagnosis.json").is_file()):
        return None
    try:
        (row,) = pq.read_table(path, schema=SCHEMA, partitioning=None).to_pylist()
    except (OSError, ValueError, pa.ArrowException):
        return None
    return row if row["error"] is None else None


def _keep(out: Path, rig: Path, outcome: RigAnswer | TaskError) -> dict[str, Any]:
    """Write what was found of a rig; its part last, since that says that it is done."""
    row: dict[str, Any] = dict.fromkeys(SCHEMA.names) | {"name": rig.name}
    if isinstance(outcome, RigAnswer):
        write_diagnosis(outcome.texts, out / "rigs" / rig.name)
        row |= outcome.row
    else:
        row["error"] = outcome.reason.replace(f"{rig}{os.sep}", "")
    path = _place(out, rig.name)
    make_folder(path.parent)
    with replacing(path) as temporary:
        pq.write_table(pa.Table.from_pylist([row], SCHEMA), temporary)
    return row


def _stale(out: Path, rigs: Sequence[Path]) -> tuple[str, ...]:
    there = {_place(out, rig.name).parent.name for rig in rigs}
    parts = (out / "parts").glob("rig=*")
    return tuple(sorted(p.name.removeprefix("rig=") for p in parts if p.name not in there))
