"""Recordings as the commands take them: files with column maps, or one folder with a manifest."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drill_env._errors import InputError

if TYPE_CHECKING:
    from drill_env.parameters import Rig
    from drill_env.recordings import RecordingSet, RecordingWarning


def read_set(
    fit: Sequence[Path],
    mapping: Sequence[str],
    holdout: Sequence[Path] = (),
    stage1: Sequence[Path] = (),
) -> RecordingSet:
    """Recordings by what they are for.

    Args:
        fit: files to fit, or one folder that says itself what each file is for.
        mapping: column maps, for files or a folder without a manifest.
        holdout: files to judge by.
        stage1: files of the upper disc alone.

    Raises:
        InputError: a recording cannot be read, none is to be fitted, or options contradict.
    """
    from drill_env.recordings import RecordingSet, parse_map, read_folder, read_recording

    if len(fit) == 1 and fit[0].is_dir():
        for option, given in (("--holdout", holdout), ("--stage1", stage1)):
            if given:
                raise InputError(f"{option} does not go with a folder: use recordings.toml there")
        found = read_folder(fit[0], columns=parse_map(mapping))
    else:
        _check_once([*stage1, *fit, *holdout])
        columns = parse_map(mapping)
        groups = [
            tuple(read_recording(path, columns, need=("u",)) for path in paths)
            for paths in (stage1, fit, holdout)
        ]
        found = RecordingSet(stage1=groups[0], fit=groups[1], holdout=groups[2])
    if not found.fit:
        raise InputError(f"{fit[0]}: no recording to fit; give one the role fit")
    return found


def look_over(
    found: RecordingSet, rig: Rig | None, *, incomplete: bool = False, strict: bool = True
) -> list[RecordingWarning]:
    """Warn of what is doubtful in recordings.

    Args:
        found: the recordings.
        rig: the rig if it is known.
        incomplete: physics may be missing from it.
        strict: whether a recording that cannot come from a rig is an error and no warning.

    Returns:
        The warnings.

    Raises:
        InputError: a recording cannot come from a rig, and that is an error, or states an effect
            that is wrong.
    """
    from drill_env.identification.known_loads import known_effects
    from drill_env.identification.screening import findings, screen
    from drill_env.parameters import Rig

    for recording in (*found.stage1, *found.fit, *found.holdout):
        known_effects(rig or Rig.paper(), recording)
    told = []
    for recording in (*found.fit, *found.holdout):
        seen = screen(recording, rig, incomplete=incomplete) if strict else findings(recording, rig)
        for remark in seen:
            warnings.warn(remark, stacklevel=2)
            told.append(remark)
    return told


def _check_once(paths: Sequence[Path]) -> None:
    """Raise where a file is given twice, or a folder among files."""
    seen: set[Path] = set()
    for path in paths:
        if path.is_dir():
            raise InputError(f"{path} is a folder: give one folder alone, or files")
        if path.resolve() in seen:
            raise InputError(
                f"{path} is given twice: fit and judge by different recordings, each given once"
            )
        seen.add(path.resolve())
