"""What the readers of the process apart share: columns as Arrow tables, and refusals."""

from __future__ import annotations

from typing import Any

CONSTANT = b"constant"
"""Key in the schema of a single number that is no column."""


class TooLarge(Exception):
    """The file holds more than is allowed."""


class Refused(Exception):
    """The file is whole and yet no recording; the text says why, and the remedy."""


def within(rows: int, columns: int, limits: dict[str, int]) -> None:
    """Raise `TooLarge` where so many rows of so many columns are beyond the limits."""
    if rows > limits["rows"] or columns > limits["columns"] or rows * columns > limits["values"]:
        raise TooLarge


def constant(name: str, value: float) -> Any:
    """A single number as a table."""
    import pyarrow as pa

    return pa.table({name: [float(value)]}).replace_schema_metadata({CONSTANT: b"1"})
