"""The JSON Schema of `diagnosis.json`."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any


def schema() -> dict[str, Any]:
    """The schema (draft 2020-12) of what `drill-env diagnose` writes, as plain values."""
    text = files("drill_env.diagnosis").joinpath("schema.json").read_text(encoding="utf-8")
    return json.loads(text)
