"""Harness of the reader of JSON logs."""

from __future__ import annotations

import json

from hypothesis import strategies as st

from benchmarks.fuzz.inputs import HOSTILE, mutated, numbers, values
from benchmarks.fuzz.judge import Harness
from benchmarks.fuzz.recorded import channels, read_binary, ways


def json_seeds() -> tuple[bytes, ...]:
    """The clean recording as rows, lines, columns, as pandas writes it, and with a nested name."""
    columns = {name: column.tolist() for name, column in channels().items()}
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    nested = [{**row, "motor": {"volt": row["u"], "on": True, "x": None}} for row in rows]
    numbered = {name: dict(enumerate(column)) for name, column in columns.items()}
    lines = "\n".join(json.dumps(row) for row in nested)
    whole = (rows, {**columns, "gain": 0.5, "word": "a", "m": [[1, 2], [3]]}, numbered)
    return (lines.encode(), *(json.dumps(form).encode() for form in whole))


@st.composite
def json_made(draw: st.DrawFn) -> bytes:
    """Valid JSON of rows with values of any kind in them."""
    given = st.one_of(numbers, values.filter(lambda v: not isinstance(v, bytes)))
    rows = json.loads(json_seeds()[1])
    for _ in range(draw(st.integers(1, 4))):
        key = st.one_of(st.sampled_from(["t", "u", "a.b"]), st.sampled_from(HOSTILE))
        draw(st.sampled_from(rows))[draw(key)] = draw(given)
    return json.dumps(rows, default=str).encode("utf-8", "surrogatepass")


JSON = Harness(
    "json",
    st.tuples(
        st.sampled_from(["run.json", "run.jsonl"]),
        st.one_of(mutated(json_seeds(), text=True), json_made()), ways,
    ),
    read_binary,
)  # fmt: skip
