"""The files of a diagnosis: page, all numbers, extended rig."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from drill_env._documents import plain
from drill_env._files import make_folder, write_texts
from drill_env.parameters import dump_rig
from drill_env.report.diagnosis_page import diagnosis_page

if TYPE_CHECKING:
    from drill_env.diagnosis.by_prediction import PredictionDiagnosis
    from drill_env.diagnosis.diagnose import Diagnosis


def diagnosis_texts(found: Diagnosis | PredictionDiagnosis) -> dict[str, str]:
    """The contents of each file, by its name."""
    document = json.dumps(plain(found.result.as_dict()), indent=2, allow_nan=False)
    return {
        "diagnosis.json": document + "\n",
        "rig-extended.toml": dump_rig(found.rig),
        "index.html": diagnosis_page(found),
    }


def write_diagnosis(texts: dict[str, str], out: Path) -> None:
    """Write all of them into a folder, or none."""
    make_folder(out)
    write_texts({out / name: text for name, text in texts.items()})
