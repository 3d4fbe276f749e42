"""One rig of a fleet, from its folder to its row and its report."""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from drill_env._errors import InputError, printable
from drill_env.diagnosis.diagnose import Diagnosis, diagnose
from drill_env.diagnosis.doubtful import with_remarks
from drill_env.diagnosis.since import Since, since
from drill_env.fleet.row import row_of
from drill_env.fleet.settings import RIG_FILE, FleetSettings, digest_of_rig
from drill_env.identification.screening import findings
from drill_env.parameters import Rig, load_rig
from drill_env.recordings import RecordingSet, RecordingWarning, read_folder
from drill_env.report.diagnosis_files import diagnosis_texts


@dataclass(frozen=True, slots=True)
class RigTask:
    """A rig to diagnose.

    Attributes:
        folder: its recordings and, if it has one, its `rig.toml`.
        known: digest of what was diagnosed before, None if nothing was.
    """

    folder: Path
    known: str | None


@dataclass(frozen=True, slots=True)
class RigAnswer:
    """A rig that was diagnosed.

    Attributes:
        row: columns of `drill_env.fleet.row.SCHEMA`.
        texts: the files of its report.
    """

    row: dict[str, Any]
    texts: dict[str, str]


def diagnose_rig(task: RigTask, settings: FleetSettings) -> RigAnswer | None:
    """Diagnose a rig, None where nothing changed since it was done.

    Raises:
        InputError: a file of the rig is bad.
    """
    began = time.process_time()
    digest = digest_of_rig(task.folder, settings)
    if digest == task.known:
        return None
    path = task.folder / RIG_FILE
    rig = load_rig(path) if path.is_file() else settings.rig
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        recordings = read_folder(task.folder)
        _look_over(recordings, task.folder, rig if path.is_file() else None)
        options = replace(settings.options, given_rig=path.is_file())
        newest = newest_of(recordings)
        found = diagnose(newest.fit, rig, newest.holdout, options=options)
        remarks = _remarks(heard)
        found = replace(found, result=with_remarks(found.result, remarks))
        row = row_of(found.result, _since(found, recordings, newest))
        texts = diagnosis_texts(found)
    row |= {
        "name": task.folder.name, "cpu_s": time.process_time() - began, "error": None,
        "remarks": "; ".join(printable(r) for r in remarks) or None, "digest": digest,
    }  # fmt: skip
    return RigAnswer(row, texts)


def _look_over(found: RecordingSet, folder: Path, given: Rig | None) -> None:
    if not found.fit:
        raise InputError(f"{folder}: no recording to fit; give one the role fit")
    for recording in (*found.fit, *found.holdout):
        for remark in findings(recording, given):
            warnings.warn(remark, stacklevel=2)


def newest_of(found: RecordingSet) -> RecordingSet:
    """The recordings that tell what a rig is like now.

    Those without a date, and of the others as many of the newest days as it takes to have one
    recording to fit and, if there is any, one to judge by.
    """
    days = {r.source: found.of(r).date for r in (*found.fit, *found.holdout)}
    for day in sorted({d for d in days.values() if d is not None}, reverse=True):
        kept = {name for name, d in days.items() if d is None or d >= day}
        fit, holdout = (
            tuple(r for r in group if r.source in kept) for group in (found.fit, found.holdout)
        )
        if fit and (holdout or not found.holdout):
            return replace(found, fit=fit, holdout=holdout)
    return found


def _since(found: Any, whole: RecordingSet, newest: RecordingSet) -> Since | None:
    # Of an axis there is no fit that could be asked again.
    if not isinstance(found, Diagnosis):
        return None
    asked = {r.source for r in (*newest.fit, *newest.holdout)}
    older = [r for r in (*whole.fit, *whole.holdout) if r.source not in asked]
    return since(found, {name: told.date for name, told in whole.settings.items()}, older)


def _remarks(heard: list[warnings.WarningMessage]) -> list[RecordingWarning]:
    """What is doubtful in the recordings, each once; that a fleet has no manifests is usual."""
    told = [w.message for w in heard if isinstance(w.message, RecordingWarning)]
    return list({str(m): m for m in told if m.code != "no_manifest"}.values())
