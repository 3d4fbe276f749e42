"""Files read in a confined process: Parquet, MATLAB and JSON to columns in Arrow's form.

Each column or constant is a stream of its own, since those of a file need not be equally long.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from drill_env.recordings._apart_columns import Refused, TooLarge, within
from drill_env.recordings._apart_json import json_columns
from drill_env.recordings._apart_mat import mat_columns

DAMAGED, TOO_LARGE, NEWER_MAT, REFUSED = 3, 4, 5, 6
"""Exit statuses, beside 0 and what a crash leaves; a refusal's text is on standard error."""


def parquet_columns(path: Path, limits: dict[str, int]) -> Iterator[Any]:
    """The columns of a Parquet file, each as a table of one column."""
    import pyarrow.parquet as pq

    with pq.ParquetFile(path) as file:
        told = file.metadata
        within(told.num_rows, told.num_columns, limits)
        unpacked = sum(told.row_group(i).total_byte_size for i in range(told.num_row_groups))
        if unpacked > limits["bytes"]:
            raise TooLarge
        table = file.read(use_threads=False)
    within(table.num_rows, table.num_columns, limits)
    if table.nbytes > limits["bytes"]:
        raise TooLarge
    # Rows that say more or less of their columns than was told end here.
    table.validate(full=True)
    for place in range(table.num_columns):
        yield _plain(table.select([place]))


def _plain(table: Any) -> Any:
    """Nothing but numbers, text, truth values and times; another kind says so in words."""
    import pyarrow as pa
    import pyarrow.types as kinds

    field = table.schema.field(0)
    asked = (
        kinds.is_integer, kinds.is_floating, kinds.is_boolean, kinds.is_string, kinds.is_null,
        kinds.is_large_string, kinds.is_timestamp, kinds.is_date, kinds.is_time, kinds.is_duration,
    )  # fmt: skip
    column = table.column(0)
    if kinds.is_decimal(field.type) or kinds.is_float16(field.type):
        column = column.cast(pa.float64())
    elif not any(is_kind(field.type) for is_kind in asked):
        column = pa.repeat(str(field.type)[:80], table.num_rows)
    return pa.table({field.name: column})


def confine(memory: int, seconds: int) -> None:
    """Let this process take so many bytes and seconds of CPU more than now, and dump no core."""
    try:
        import resource

        last = math.ceil(time.process_time()) + seconds
        resource.setrlimit(resource.RLIMIT_CPU, (last, last))

        pages = int(Path("/proc/self/statm").read_text().split()[0])
        most = pages * resource.getpagesize() + memory
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    except (ImportError, OSError, ValueError):
        # Systems without such limits: what the file says of its size is checked all the same.
        return


def main(kind: str, path: Path, limits: dict[str, int], wanted: Sequence[str]) -> int:
    """Write the columns to standard output; returns the exit status.

    Args:
        kind: "parquet", "mat" or "json".
        path: of the file.
        limits: of the file, and the memory and seconds that reading it may take.
        wanted: places in a MATLAB workspace that are columns too.
    """
    import pyarrow as pa

    readers = {
        "parquet": lambda: parquet_columns(path, limits),
        "mat": lambda: mat_columns(path, limits, wanted),
        "json": lambda: json_columns(path, limits),
    }
    # Imported before the limit, which counts what the process has already.
    __import__({"parquet": "pyarrow.parquet", "mat": "scipy.io", "json": "pyarrow"}[kind])
    confine(limits["memory"], limits["seconds"])
    try:
        # The descriptor itself, since sys.stdout may be another in a fork.
        with open(1, "wb", closefd=False) as out:
            for table in readers[kind]():
                with pa.ipc.new_stream(out, table.schema) as stream:
                    stream.write_table(table)
    except (TooLarge, MemoryError):
        return TOO_LARGE
    except Refused as error:
        os.write(2, str(error)[:500].encode("ascii", "backslashreplace"))
        return REFUSED
    except NotImplementedError:
        return NEWER_MAT if kind == "mat" else DAMAGED
    except Exception as error:
        # Whatever the libraries raise on damaged bytes means the same.
        os.write(2, f"{type(error).__name__}: {error}"[:500].encode("ascii", "backslashreplace"))
        return DAMAGED
    return 0
