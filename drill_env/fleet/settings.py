"""How the rigs of a fleet are diagnosed, and whether one was so already."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import Path

from drill_env._code import digest_of_code
from drill_env._errors import InputError
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.parameters import Rig

RIG_FILE = "rig.toml"
_CODE = (
    "parameters", "friction", "dynamics", "effects", "effects/library", "integrator", "recordings",
    "identification", "prediction", "diagnosis", "fleet/rig.py", "fleet/row.py",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class FleetSettings:
    """How each rig is diagnosed.

    Attributes:
        rig: where rigs without a file `rig.toml` start; the paper's rig by default.
        options: of the diagnosis; `given_rig` follows from whether a rig file is there.
    """

    rig: Rig = field(default_factory=Rig.paper)
    options: DiagnosisOptions = field(default_factory=DiagnosisOptions)


def rig_folders(folder: Path) -> list[Path]:
    """The folders right in a folder, by name, one a rig.

    Raises:
        InputError: there is none.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; give one with a folder for each rig")
    found = sorted(f for f in folder.iterdir() if f.is_dir() and not f.name.startswith("."))
    if not found:
        raise InputError(f"{folder}: no folders in it; give one with a folder for each rig")
    return found


def digest_of_rig(folder: Path, settings: FleetSettings) -> str:
    """Hash of all that a rig's diagnosis depends on: its files, the settings and the code."""
    digest = hashlib.sha256(f"{settings!r} {digest_of_code(*_CODE)}".encode())
    for path in sorted(f for f in folder.rglob("*") if f.is_file()):
        with path.open("rb") as stream:
            content = hashlib.file_digest(stream, "sha256").hexdigest()
        digest.update(f"{path.relative_to(folder)!s} {content}\n".encode(errors="backslashreplace"))
    return digest.hexdigest()
