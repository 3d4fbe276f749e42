"""Raw columns out of CSV, Parquet, MATLAB and JSON files."""

from __future__ import annotations

import codecs
import csv
import gzip
import zlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from drill_env._errors import InputError, printable
from drill_env._types import FloatArray
from drill_env.recordings import limits
from drill_env.recordings.apart import Contents, read_apart, too_large_text

if TYPE_CHECKING:
    import pyarrow as pa

Values: TypeAlias = "NDArray[Any] | pa.ChunkedArray"

_DAMAGED = (EOFError, zlib.error, gzip.BadGzipFile)
_BLOCK = 100_000


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """A file's contents before any meaning is given to them.

    Attributes:
        columns: values by name, numeric or not, each of shape (n,).
        constants: single numbers by name.
        first_row: number of the first data row in the file, for messages.
        others: what else the file holds, in words, for messages.
    """

    columns: dict[str, Values]
    constants: dict[str, float] = field(default_factory=dict)
    first_row: int = 1
    others: tuple[str, ...] = ()


def read_table(path: Path, wanted: Sequence[str] = ()) -> Table:
    """Read the columns of a CSV, Parquet, MATLAB or JSON file.

    Args:
        path: of the file.
        wanted: texts that may be places in a MATLAB workspace, which are then columns too.

    Raises:
        InputError: the file is missing, damaged, empty, too large or of an unknown kind.
    """
    name = path.name.lower()
    kinds = {
        (".csv", ".csv.gz", ".txt", ".tsv"): _read_csv,
        (".parquet", ".pq"): _read_parquet,
        (".mat",): _read_mat,
        (".json", ".json.gz", ".jsonl", ".jsonl.gz", ".ndjson", ".ndjson.gz"): _read_json,
    }
    try:
        if path.is_dir():
            raise InputError(f"{path} is a folder: give one file")
        reader = next((r for ends, r in kinds.items() if name.endswith(ends)), None)
        if reader is None:
            raise InputError(f"{path}: unknown kind of file; give .csv, .parquet, .mat or .json")
        if not path.is_file():
            raise InputError(f"{path}: no such file; check the path")
        if path.stat().st_size == 0:
            raise InputError(f"{path}: the file is empty; record or export it again")
        _check_size(path, path.stat().st_size)
        return reader(path, wanted)
    except _DAMAGED as error:
        raise InputError(f"{path}: the file is truncated or damaged; copy it again") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error}); check the file") from error


def _check_size(path: Path, size: int) -> None:
    if size > limits.MOST_BYTES:
        raise InputError(f"{path}: {too_large_text()}")


def _read_csv(path: Path, wanted: Sequence[str]) -> Table:
    if path.suffix.lower() == ".gz":
        with gzip.open(path) as stream:
            content = stream.read(limits.MOST_BYTES + 1)
        _check_size(path, len(content))
    else:
        content = path.read_bytes()
    start, end = 3 * content.startswith(b"\xef\xbb\xbf"), _line_end(content)
    names, separator = _header(path, content[start : min(end, limits.LONGEST_HEADER + 1)])
    first = content.count(b"\n", 0, end + 1) + content.count(b"\r", 0, end + 1)
    rows = max(content.count(b"\n"), content.count(b"\r")) - first
    if rows > limits.MOST_ROWS or rows * len(names) > limits.MOST_VALUES:
        raise InputError(f"{path}: {too_large_text()}")
    return _parse(path, memoryview(content)[end:], names, separator)


def _line_end(content: bytes) -> int:
    """Where the first line ends: old exports end lines by a carriage return alone."""
    ends = [content.find(mark, 0, limits.LONGEST_HEADER + 1) for mark in (b"\n", b"\r")]
    return min((end for end in ends if end >= 0), default=len(content))


def _header(path: Path, line: bytes) -> tuple[list[str], str]:
    if len(line) > limits.LONGEST_HEADER:
        raise InputError(
            f"{path}: the first line has more than {limits.LONGEST_HEADER} bytes and no end; "
            "name the columns in a line of their own"
        )
    try:
        head = line.decode("utf-8").strip().lstrip("#").strip()
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: {_NO_TEXT}") from error
    separator = max(",;\t", key=head.count)
    try:
        names = [n.strip() for n in next(csv.reader([head], delimiter=separator), [])]
    except csv.Error as error:
        raise InputError(f"{path}: the header is no line of CSV ({error}); mend it") from error
    if any(names) and all(_is_number(name) for name in names):
        raise InputError(f"{path}: no header line; name the columns in the first line, t,u,…")
    if not any(names):
        raise InputError(f"{path}: the file is empty; record or export it again")
    _check_names(path, names)
    return names, separator


def _check_text(path: Path, body: memoryview) -> None:
    """Refuse what is no UTF-8, piece by piece: whole, the text would take the memory again."""
    decoder = codecs.getincrementaldecoder("utf-8")()
    try:
        for start in range(0, len(body), _BLOCK):
            decoder.decode(body[start : start + _BLOCK])
        decoder.decode(b"", final=True)
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: {_NO_TEXT}") from error


_NO_TEXT = "not a text file in UTF-8; export it as CSV in UTF-8"


def _parse(path: Path, body: memoryview, names: list[str], separator: str) -> Table:
    import pyarrow as pa
    from pyarrow import csv as arrow_csv

    if not bytes(body[:_BLOCK]).strip() and not bytes(body).strip():
        raise InputError(f"{path}: a header but no rows; record or export it again")
    _check_text(path, body)
    try:
        table = arrow_csv.read_csv(
            pa.BufferReader(pa.py_buffer(body)),
            # One block, since Arrow settles each column's type by the first one.
            arrow_csv.ReadOptions(column_names=names, block_size=len(body) + 1),
            arrow_csv.ParseOptions(delimiter=separator),
        )
    except pa.ArrowInvalid as error:
        raise InputError(
            f"{path}: a row does not match the header's {len(names)} columns (data "
            f"{printable(str(error).split('error: ')[-1], 100)}); export the file again, "
            "or delete the row if it is the last one and was cut short"
        ) from error
    return Table({n: table.column(n) for n in names}, first_row=2)


def _check_names(path: Path, names: list[str]) -> None:
    if len(names) > limits.MOST_COLUMNS:
        raise InputError(f"{path}: {len(names)} columns; {too_large_text()}")
    repeated = sorted(name for name, times in Counter(names).items() if times > 1)
    if repeated:
        name = printable(repeated[0], 80)
        raise InputError(f"{path}: column {name!r} comes twice; rename one of them")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _read_parquet(path: Path, wanted: Sequence[str]) -> Table:
    return _table(path, read_apart(path, "parquet"))


def _read_mat(path: Path, wanted: Sequence[str]) -> Table:
    return _table(path, read_apart(path, "mat", wanted))


def _read_json(path: Path, wanted: Sequence[str]) -> Table:
    return _table(path, read_apart(path, "json"))


def _table(path: Path, held: Contents) -> Table:
    _check_names(path, [name for name, _ in held.columns])
    return Table(dict(held.columns), held.constants, others=held.others)


def as_numbers(values: Values, where: str, first_row: int = 1) -> FloatArray:
    """A column as floats, shape (n,).

    Raises:
        InputError: a value is no number; the message names it and its row.
    """
    if not isinstance(values, np.ndarray):
        # In blocks: as Python's text a column takes ten times its memory.
        found = np.empty(len(values))
        for start in range(0, len(values), _BLOCK):
            block = np.asarray(values.slice(start, _BLOCK).to_pandas())
            found[start : start + _BLOCK] = as_numbers(block, where, first_row + start)
        return found
    if values.dtype.kind in "fiu":
        return np.ascontiguousarray(values, dtype=float)
    import pandas as pd

    if values.dtype.kind in "mMbc":
        raise InputError(f"{where} holds {values.dtype} values; give plain numbers in its unit")
    try:
        numbers = pd.to_numeric(pd.Series(values), errors="coerce").to_numpy(dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{where} is not numeric ({error}); remove units and words") from error
    bad = np.flatnonzero(np.isnan(numbers) & ~np.asarray(pd.isna(cast(Any, values))))
    if len(bad):
        value = printable(values[bad[0]], 60)
        hint = "write decimals with a point" if "," in value else "remove units and words"
        raise InputError(f"{where} is not numeric: {value!r} in row {bad[0] + first_row}; {hint}")
    return np.ascontiguousarray(numbers)
