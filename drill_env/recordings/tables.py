"""Raw columns out of CSV, Parquet and MATLAB files."""

from __future__ import annotations

import csv
import gzip
import io
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from drill_env._errors import InputError
from drill_env._types import FloatArray

LARGEST_FILE = 1_000_000_000
"""Bytes beyond which a file is refused: at 1 kHz some four hours."""

_DAMAGED = (EOFError, zlib.error, gzip.BadGzipFile)


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """A file's contents before any meaning is given to them.

    Attributes:
        columns: values by name, numeric or not, each of shape (n,).
        constants: single numbers by name.
        first_row: number of the first data row in the file, for messages.
    """

    columns: dict[str, NDArray[Any]]
    constants: dict[str, float] = field(default_factory=dict)
    first_row: int = 1


def read_table(path: Path) -> Table:
    """Read the columns of a .csv, .csv.gz, .parquet or .mat file.

    Raises:
        InputError: the file is missing, damaged, empty or of an unknown kind.
    """
    name = path.name.lower()
    kinds = {
        (".csv", ".csv.gz", ".txt", ".tsv"): _read_csv,
        (".parquet", ".pq"): _read_parquet,
        (".mat",): _read_mat,
    }
    if path.is_dir():
        raise InputError(f"{path} is a folder: give one file")
    reader = next((r for ends, r in kinds.items() if name.endswith(ends)), None)
    if reader is None:
        raise InputError(f"{path}: unknown kind of file; give .csv, .csv.gz, .parquet or .mat")
    if not path.is_file():
        raise InputError(f"{path}: no such file; check the path")
    if path.stat().st_size == 0:
        raise InputError(f"{path}: the file is empty; record or export it again")
    _check_size(path, path.stat().st_size)
    try:
        return reader(path)
    except _DAMAGED as error:
        raise InputError(f"{path}: the file is truncated or damaged; copy it again") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error}); check the file") from error


def _check_size(path: Path, size: int) -> None:
    if size > LARGEST_FILE:
        raise InputError(
            f"{path}: more than {LARGEST_FILE:.2g} bytes, too large for a recording of the rig; "
            "cut it into pieces or keep fewer samples per second"
        )


def _read_csv(path: Path) -> Table:
    import pyarrow as pa
    from pyarrow import csv as arrow_csv

    if path.suffix.lower() != ".gz":
        content = path.read_bytes()
    else:
        with gzip.open(path) as stream:
            content = stream.read(LARGEST_FILE + 1)
        _check_size(path, len(content))
    try:
        header, _, body = content.decode("utf-8-sig").partition("\n")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a text file in UTF-8; export it as CSV in UTF-8") from error
    head = header.strip().lstrip("#").strip()
    separator = max(",;\t", key=head.count)
    names = [n.strip() for n in next(csv.reader([head], delimiter=separator), [])]
    _check_header(path, names)
    if not body.strip():
        raise InputError(f"{path}: a header but no rows; record or export it again")
    rows = body.encode()
    try:
        table = arrow_csv.read_csv(
            io.BytesIO(rows),
            # One block, since Arrow settles each column's type by the first one.
            arrow_csv.ReadOptions(column_names=names, block_size=len(rows) + 1),
            arrow_csv.ParseOptions(delimiter=separator),
        )
    except pa.ArrowInvalid as error:
        raise InputError(
            f"{path}: a row does not match the header's {len(names)} columns (data "
            f"{str(error).split('error: ')[-1]}); export the file again, "
            "or delete the row if it is the last one and was cut short"
        ) from error
    return Table({n: np.asarray(table.column(n).to_pandas()) for n in names}, first_row=2)


def _check_header(path: Path, names: list[str]) -> None:
    if not any(names):
        raise InputError(f"{path}: the file is empty; record or export it again")
    if all(_is_number(name) for name in names):
        raise InputError(f"{path}: no header line; name the columns in the first line, t,u,…")
    repeated = sorted({n for n in names if names.count(n) > 1})
    if repeated:
        raise InputError(f"{path}: column {repeated[0]!r} comes twice; rename one of them")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _read_parquet(path: Path) -> Table:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(path)
    except (pa.ArrowInvalid, pa.ArrowIOError) as error:
        raise InputError(f"{path}: not a whole Parquet file; copy or export it again") from error
    names = table.column_names
    return Table({n: np.asarray(table.column(n).to_pandas()) for n in names})


def _read_mat(path: Path) -> Table:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        content = cast(Mapping[str, Any], loadmat(path))
    except NotImplementedError as error:
        raise InputError(
            f"{path}: MATLAB 7.3 files are not read; save it with save(…, '-v7')"
        ) from error
    except (MatReadError, ValueError, TypeError, KeyError, IndexError) as error:
        raise InputError(f"{path}: not a whole MATLAB file; copy or save it again") from error
    columns: dict[str, NDArray[Any]] = {}
    constants: dict[str, float] = {}
    for name, value in content.items():
        array = np.asarray(value)
        if name.startswith("__") or array.dtype.kind not in "fiub":
            continue
        if array.size == 1:
            constants[name] = float(array.item())
        elif array.ndim <= 2 and max(array.shape) == array.size:
            columns[name] = array.ravel()
    return Table(columns, constants)


def as_numbers(values: NDArray[Any], where: str, first_row: int = 1) -> FloatArray:
    """A column as floats, shape (n,).

    Raises:
        InputError: a value is no number; the message names it and its row.
    """
    if values.dtype.kind in "fiu":
        return np.ascontiguousarray(values, dtype=float)
    import pandas as pd

    if values.dtype.kind in "mMbc":
        raise InputError(f"{where} holds {values.dtype} values; give plain numbers in its unit")
    numbers = pd.to_numeric(pd.Series(values), errors="coerce").to_numpy(dtype=float)
    bad = np.flatnonzero(np.isnan(numbers) & ~np.asarray(pd.isna(values)))
    if len(bad):
        value = str(values[bad[0]])
        hint = "write decimals with a point" if "," in value else "remove units and words"
        raise InputError(f"{where} is not numeric: {value!r} in row {bad[0] + first_row}; {hint}")
    return np.ascontiguousarray(numbers)
