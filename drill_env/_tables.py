"""Tables in and out: CSV or Parquet by the file's ending, written whole or not at all."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from drill_env._errors import InputError
from drill_env._files import replacing

if TYPE_CHECKING:
    import pandas as pd


def check_table_name(path: Path) -> None:
    """Refuse endings that no table can be written to, before any work is done.

    Raises:
        InputError: the ending is neither .csv, .csv.gz nor .parquet.
    """
    if path.suffix != ".parquet" and not path.name.endswith((".csv", ".csv.gz")):
        raise InputError(f"output {path}: give a name that ends in .csv, .csv.gz or .parquet")


def write_table(table: pd.DataFrame, path: Path) -> None:
    """Write a table with every digit a float has."""
    check_table_name(path)
    with replacing(path) as temporary:
        if path.suffix == ".parquet":
            table.to_parquet(temporary, index=False)
        else:
            compression = "gzip" if path.suffix == ".gz" else None
            table.to_csv(temporary, index=False, compression=compression)
