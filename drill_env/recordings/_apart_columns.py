"""What the readers of the process apart share: columns as Arrow tables, and refusals."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from numpy.typing import NDArray

CONSTANT, OTHER = b"constant", b"other"
"""Keys in the schema of a single number that is no column, and of what is a name alone."""

PLACE = re.compile(
    r"[A-Za-z]\w{0,80}(?:\.\w{1,80}|\[[\d:, ]{1,40}\]|\([\d:, ]{1,40}\)|\{\d{1,9}\}){0,20}"
)
"""A place in a MATLAB workspace: `data(:,3)`, `run.x[:,2]`, `out.signals(1).values`."""


class TooLarge(Exception):
    """The file holds more than is allowed."""


class Refused(Exception):
    """The file is whole and yet no recording; the text says why, and the remedy."""


def within(rows: int, columns: int, limits: dict[str, int]) -> None:
    """Raise `TooLarge` where so many rows of so many columns are beyond the limits."""
    if rows > limits["rows"] or columns > limits["columns"] or rows * columns > limits["values"]:
        raise TooLarge


def column(name: str, values: NDArray[Any]) -> Any:
    """A vector of numbers or truth values as a table."""
    import pyarrow as pa

    return pa.table(
        {name: pa.array(values.ravel().astype(bool if values.dtype.kind == "b" else float))}
    )


def constant(name: str, value: float) -> Any:
    """A single number as a table."""
    import pyarrow as pa

    return pa.table({name: [float(value)]}).replace_schema_metadata({CONSTANT: b"1"})


def other(name: str) -> Any:
    """The name of what is no column, for messages."""
    import pyarrow as pa

    return pa.table({name: pa.nulls(0)}).replace_schema_metadata({OTHER: b"1"})
