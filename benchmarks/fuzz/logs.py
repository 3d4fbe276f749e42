"""Harness of the reader of JSON logs."""

from __future__ import annotations

import json

from benchmarks.fuzz.dice import Dice
from benchmarks.fuzz.hostile import HOSTILE
from benchmarks.fuzz.inputs import mutated
from benchmarks.fuzz.judge import Harness
from benchmarks.fuzz.recorded import channels, read_binary, way


def json_seeds() -> tuple[bytes, ...]:
    """The clean recording as rows, lines, columns, as pandas writes it, and with a nested name."""
    columns = {name: column.tolist() for name, column in channels().items()}
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    nested = [{**row, "motor": {"volt": row["u"], "on": True, "x": None}} for row in rows]
    numbered = {name: dict(enumerate(column)) for name, column in columns.items()}
    lines = "\n".join(json.dumps(row) for row in nested)
    whole = (rows, {**columns, "gain": 0.5, "word": "a", "m": [[1, 2], [3]]}, numbered)
    return (lines.encode(), *(json.dumps(form).encode() for form in whole))


JSON_SEEDS = json_seeds()
ROWS = json.loads(JSON_SEEDS[1])


def json_made(dice: Dice) -> bytes:
    """Valid JSON of rows with values of any kind in them."""
    rows = [dict(row) for row in ROWS]
    for _ in range(dice.whole(1, 4)):
        key = dice.pick(("t", "u", "a.b")) if dice.chance(0.5) else dice.pick(HOSTILE)
        dice.pick(rows)[key] = _plain(dice.value())
    return json.dumps(rows, default=str).encode("utf-8", "surrogatepass")


def _plain(value: object) -> object:
    """As JSON has it: whole numbers of any length are Python's alone."""
    return str(value)[:400] if isinstance(value, int) and abs(value) > 2**64 else value


def log(dice: Dice) -> tuple[str, bytes, tuple[int, bool]]:
    """A damaged log, or a whole one with odd values."""
    made = json_made(dice) if dice.chance(0.5) else mutated(dice, JSON_SEEDS, text=True)
    return dice.pick(("run.json", "run.jsonl")), made, way(dice)


JSON = Harness("json", log, read_binary)
