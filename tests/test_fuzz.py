"""A short seeded run of every fuzz harness; the long one is `make fuzz`."""

from __future__ import annotations

import pytest

from benchmarks.fuzz.harnesses import HARNESSES
from benchmarks.fuzz.judge import fuzz

INPUTS = {"parquet": 30, "mat": 30, "json": 60, "reset": 60, "effects": 120}


@pytest.mark.parametrize("name", HARNESSES)
def test_hostile_input_is_read_or_refused_by_one_line(name, tmp_path):
    """The harness raises what the reader let through, and checks what it accepted."""
    tally = fuzz(HARNESSES[name], tmp_path, INPUTS.get(name, 150), start=20)
    assert tally.tried >= INPUTS.get(name, 150) and tally.reasons
