"""Checks of arguments that anything may be given for."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drill_env._errors import InputError, printable


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
