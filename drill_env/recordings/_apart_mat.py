"""MATLAB files as columns: their vectors, and what a map picks out of matrices and structs."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drill_env.recordings._apart_columns import Refused, column, constant, other, within

if TYPE_CHECKING:
    from numpy.typing import NDArray

_STEP = re.compile(r"\.?(\w+)|([\[({])([^\])}]*)[\])}]")


def mat_columns(path: Path, limits: dict[str, int], wanted: Sequence[str]) -> Iterator[Any]:
    """The vectors of a MATLAB file as columns, its single numbers as constants, the rest by name.

    Args:
        path: of the file.
        limits: rows, columns and values.
        wanted: places in it that are columns too, as `data(:,3)` or `run.x[:,2]`.

    Raises:
        TooLarge: it holds more than the limits.
        Refused: a place that is wanted is no vector.
    """
    import numpy as np
    from scipy.io import loadmat, whosmat

    shapes = [(shape, name) for name, shape, _ in whosmat(path) if not name.startswith("__")]
    for shape, _ in shapes:
        lengths = [int(length) for length in shape]
        within(max(lengths, default=0), 1, limits)
        # A matrix may hold more values than a column has rows.
        within(math.prod(lengths), 1, {**limits, "rows": limits["values"]})
    within(0, len(shapes), limits)
    content = loadmat(path, variable_names=[name for _, name in shapes])
    variables = {n: np.asanyarray(v) for n, v in content.items() if not n.startswith("__")}
    for text in wanted:
        found = _picked(variables, text)
        if found is not None and text not in variables:
            yield column(text, found)
    for name, value in variables.items():
        if value.dtype.names or value.dtype.kind == "O":
            yield other(f"{name} ({_described(value)})")
        elif value.dtype.kind not in "fiub" or value.size == 0:
            continue
        elif value.size == 1:
            yield constant(name, value.item())
        elif value.ndim <= 2 and max(value.shape) == value.size:
            yield column(name, value)
        else:
            yield other(f"{name} ({_described(value)})")


def _picked(variables: dict[str, NDArray[Any]], text: str) -> NDArray[Any] | None:
    """The vector at a place, None where no variable has that name."""
    steps = list(_STEP.finditer(text))
    value = variables.get(steps[0][1])
    if value is None:
        return None
    for step in steps[1:]:
        before = text[: step.start()]
        value = _field(value, step[1], before) if step[1] else _indexed(value, step, before)
    if value.dtype.names or value.dtype.kind not in "fiub":
        raise Refused(f"{text} is {_described(value)}{_hint(value, text)}")
    value = _flat(value)
    if value.size > 1 and max(value.shape) != value.size:
        raise Refused(f"{text} is {_described(value)}; {_choices(value, text)}")
    return value.ravel()


def _field(value: NDArray[Any], name: str, before: str) -> NDArray[Any]:
    import numpy as np

    if not value.dtype.names or value.size != 1 or name not in value.dtype.names:
        raise Refused(f"no {before}.{name}: {before} is {_described(value)}{_hint(value, before)}")
    return np.asanyarray(value[name].flat[0])


def _indexed(value: NDArray[Any], step: re.Match[str], before: str) -> NDArray[Any]:
    """One element of a cell or struct array, one column or row of a matrix."""
    import numpy as np

    # In brackets Python's counting, else MATLAB's.
    first = 0 if step[2] == "[" else 1
    items = [item.strip() for item in step[3].split(",")]
    places = [int(item) - first for item in items if item.isdecimal()]
    if value.dtype.names or value.dtype.kind == "O":
        if len(items) != 1 or len(places) != 1 or not 0 <= places[0] < value.size:
            raise Refused(
                f"no {before}{step[0]}: {before} is {_described(value)}{_hint(value, before)}"
            )
        chosen = value.ravel(order="F")[places[0] : places[0] + 1]
        return chosen if value.dtype.names else np.asanyarray(chosen[0])
    matrix = _flat(value)
    if step[2] == "[" and len(items) == 1:
        items.append(":")
    axis = 1 if items[0] == ":" else 0
    if len(items) != 2 or len(places) != 1 or ":" not in items or matrix.ndim != 2:
        raise Refused(
            f"no {before}{step[0]}: {before} is {_described(value)}; {_choices(matrix, before)}"
        )
    if not 0 <= places[0] < matrix.shape[axis]:
        raise Refused(
            f"no {before}{step[0]}: {before} is {_described(value)}; {_choices(matrix, before)}"
        )
    return matrix.take(places[0], axis=axis)


def _flat(value: NDArray[Any]) -> NDArray[Any]:
    """Without the lengths of one that make a vector or matrix look like a block."""
    if value.ndim <= 2:
        return value
    lengths = [length for length in value.shape if length > 1]
    return value.reshape(lengths) if len(lengths) <= 2 else value


def _described(value: NDArray[Any]) -> str:
    shape = " x ".join(map(str, value.shape))
    if type(value).__name__ in ("MatlabOpaque", "MatlabObject", "MatlabFunction"):
        return "an object of MATLAB"
    if value.dtype.names:
        fields = ", ".join(value.dtype.names[:20])
        return f"a struct of {fields}" if value.size == 1 else f"{shape} structs of {fields}"
    if value.dtype.kind == "O":
        return f"a cell array of {shape}"
    return f"a matrix of {shape}" if value.dtype.kind in "fiub" else "no array of real numbers"


def _hint(value: NDArray[Any], text: str) -> str:
    if type(value).__name__ in ("MatlabOpaque", "MatlabObject", "MatlabFunction"):
        return "; save its numbers as plain arrays (of a timeseries x.Time and x.Data)"
    if value.dtype.names and value.size == 1:
        return f"; write {text}.{value.dtype.names[0]}"
    if value.dtype.names or value.dtype.kind == "O":
        return (
            f"; write {text}(1) to {text}({value.size}), or {text}[0] to {text}[{value.size - 1}]"
        )
    return ""


def _choices(value: NDArray[Any], text: str) -> str:
    if value.ndim != 2:
        return "save its columns as vectors"
    rows, columns = value.shape
    # The longer side is the time.
    if rows >= columns:
        return (
            f"its columns are {text}(:,1) to {text}(:,{columns}), or counted from 0 "
            f"{text}[:,0] to {text}[:,{columns - 1}]"
        )
    return (
        f"its rows are {text}(1,:) to {text}({rows},:), or counted from 0 "
        f"{text}[0,:] to {text}[{rows - 1},:]"
    )
