"""JSON logs as columns, value by value: as Python's objects a whole file takes too much memory."""

from __future__ import annotations

import gzip
import json
import math
import re
from array import array
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from drill_env.recordings._apart_columns import Refused, TooLarge, constant, within

_SPACE = re.compile(r"[ \t\r\n]*")
_FORMS = (
    "no rows of numbers: give an array of objects, one object a line, or an object of arrays, as "
    '[{"t": 0.0, "u": 1.5}, …] or {"t": [0.0, …], "u": [1.5, …]}'
)


def json_columns(path: Path, limits: dict[str, int]) -> Iterator[Any]:
    """The columns of a JSON log, each as a table of one column; nested names joined by dots.

    Args:
        path: of the file, gzipped if its name says so.
        limits: bytes once unpacked, rows, columns and values.

    Raises:
        TooLarge: it holds more than the limits.
        Refused: it is no JSON, or holds no rows.
    """
    text = _text(path, limits["bytes"])
    listed = text.startswith("[", _begin(text, 0))
    values = _values(text, listed)
    first = next(values, None)
    second = next(values, None)
    if not isinstance(first, dict):
        raise Refused(_FORMS)
    if second is None and not listed:
        yield from _of_arrays(first, limits)
        return
    columns = Columns(limits)
    columns.add(first)
    if second is not None:
        columns.add(second)
    for value in values:
        columns.add(value)
    yield from columns.tables()


def _text(path: Path, most: int) -> str:
    with gzip.open(path) if path.suffix.lower() == ".gz" else path.open("rb") as stream:
        content = stream.read(most + 1)
    if len(content) > most:
        raise TooLarge
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise Refused("not a text file in UTF-8; export it as JSON in UTF-8") from error


def _begin(text: str, at: int) -> int:
    """Where the next value or mark begins."""
    found = _SPACE.match(text, at)
    return found.end() if found else at


def _values(text: str, listed: bool) -> Iterator[Any]:
    """The values of one array, or those that stand one after the other."""
    # As floats at once: whole numbers of any length would be worth nothing and cost time.
    decoder = json.JSONDecoder(parse_int=float, object_pairs_hook=_unique)
    at = _begin(text, 0) + listed
    while (at := _begin(text, at)) < len(text):
        if listed and text[at] == "]":
            if _begin(text, at + 1) < len(text):
                raise Refused("text behind the array's end; delete it")
            return
        try:
            value, at = decoder.raw_decode(text, at)
        except RecursionError as error:
            raise Refused("not JSON of a log (nested too deeply); export it flat") from error
        except json.JSONDecodeError as error:
            raise Refused(
                f"line {error.lineno} is no JSON ({error.msg}); mend or delete it"
            ) from error
        yield value
        at = _begin(text, at)
        if listed and text.startswith(",", at):
            at += 1
        elif listed and not text.startswith("]", at):
            raise Refused("the array of rows does not end; the file was cut, copy it again")


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise Refused(f"{twice[:80]!r} comes twice in an object; rename one of them")
    return found


def _leaves(value: dict[str, Any], name: str = "") -> Iterator[tuple[str, Any]]:
    for key, item in value.items():
        full = f"{name}.{key}" if name else key
        if isinstance(item, dict):
            yield from _leaves(item, full)
        else:
            yield full, item


class Columns:
    """Columns that grow row by row.

    Args:
        limits: rows, columns and values.
    """

    def __init__(self, limits: dict[str, int]) -> None:
        self.limits = limits
        self.rows = 0
        self.numbers: dict[str, array[float]] = {}
        self.words: dict[str, dict[int, str]] = {}

    def add(self, row: Any) -> None:
        """Append a row; what it lacks is NaN."""
        if not isinstance(row, dict):
            raise Refused(f"row {self.rows + 1} is no object; {_FORMS}")
        self.rows += 1
        for name, value in _leaves(row):
            self._put(name, value)
        within(self.rows, len(self.numbers), self.limits)
        for column in self.numbers.values():
            if len(column) < self.rows:
                column.append(math.nan)

    def _put(self, name: str, value: Any) -> None:
        column = self.numbers.get(name)
        if column is None:
            within(self.rows, len(self.numbers) + 1, self.limits)
            column = self.numbers[name] = array("d", [math.nan]) * (self.rows - 1)
        if len(column) == self.rows:
            raise Refused(f"{name[:80]!r} comes twice in row {self.rows}; rename one of them")
        if type(value) is float:
            column.append(value)
            return
        column.append(math.nan)
        if value is not None:
            text = "a list" if isinstance(value, list) else str(value)
            self.words.setdefault(name, {})[self.rows - 1] = text

    def tables(self) -> Iterator[Any]:
        """Each column as a table, numbers or text."""
        import pyarrow as pa

        for name, column in self.numbers.items():
            words = self.words.get(name)
            if words is None:
                yield pa.table({name: pa.array(memoryview(column))})
            else:
                texts = [
                    words.get(i, None if math.isnan(x) else repr(x)) for i, x in enumerate(column)
                ]
                yield pa.table({name: pa.array(texts, pa.string())})


def _of_arrays(document: dict[str, Any], limits: dict[str, int]) -> Iterator[Any]:
    """The arrays of an object as columns, single numbers as constants."""
    arrays = list(_leaves({name: _indexed(item) for name, item in document.items()}))
    within(0, len(arrays), limits)
    if not any(isinstance(values, list) for _, values in arrays):
        raise Refused(_FORMS)
    seen: set[str] = set()
    for name, values in arrays:
        if name in seen:
            raise Refused(f"{name[:80]!r} comes twice; rename one of them")
        seen.add(name)
        if type(values) is float:
            yield constant(name, values)
        elif isinstance(values, list):
            within(len(values), len(arrays), limits)
            column = Columns(limits)
            for value in values:
                column.add({name: value})
            yield from column.tables()


def _indexed(value: Any) -> Any:
    """A list in place of an object that is numbered from 0, as pandas writes columns."""
    if isinstance(value, dict) and value and all(key.isdecimal() for key in value):
        return list(value.values())
    return value
