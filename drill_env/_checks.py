"""Checks of arguments that anything may be given for."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drill_env._errors import InputError, printable
from drill_env._types import FloatArray


def real(value: Any, name: str) -> float:
    """A finite number as a float.

    Args:
        value: what was given.
        name: of the argument, for the message.

    Raises:
        InputError: it is no number, a truth value, infinite, NaN or beyond all floats.
    """
    if isinstance(value, (bool, np.bool_)) or not isinstance(
        value, (int, float, np.integer, np.floating)
    ):
        raise InputError(f"{name} is {printable(repr(value), 60)}: give a number")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise InputError(f"{name} is {number}: give a finite number")
    return number


def reals(value: Any, name: str, count: int) -> tuple[float, ...]:
    """So many finite numbers.

    Raises:
        InputError: there are more or fewer, or one is no finite number.
    """
    try:
        parts = tuple(value)
    except TypeError:
        parts = ()
    if isinstance(value, (str, bytes, dict)) or len(parts) != count:
        raise InputError(f"{name} is {printable(repr(value), 60)}: give {count} numbers")
    return tuple(real(part, name) for part in parts)


def whole(value: Any, name: str, least: int) -> int:
    """A whole number, of Python or NumPy.

    Raises:
        InputError: it is no whole number, a truth value, or less than `least`.
    """
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)):
        raise InputError(f"{name} is {printable(repr(value), 60)}: give a whole number")
    if value < least:
        raise InputError(f"{name} is {value}: give {least} or more")
    return int(value)


def real_array(value: Any, name: str) -> FloatArray:
    """Finite real numbers of any shape.

    Raises:
        InputError: it is no array of numbers, or one of them is complex, infinite or NaN.
    """
    try:
        array = np.asarray(value)
    except (TypeError, ValueError, RuntimeError, OverflowError) as error:
        # RuntimeError: what tensors say that are not in this memory.
        raise InputError(
            f"{name} is {printable(repr(value), 60)}: give an array of numbers"
        ) from error
    if array.dtype.kind not in "fiu":
        raise InputError(
            f"{name} is {printable(repr(value), 60)}, of type {array.dtype}: give real numbers"
        )
    found = array.astype(np.float64, copy=False)
    if not np.isfinite(found).all():
        raise InputError(f"{name} holds NaN or infinity: give finite numbers")
    return found
