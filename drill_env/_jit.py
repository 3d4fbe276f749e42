"""The one numba decorator of the project."""

from typing import Any, TypeVar

from numba import njit

F = TypeVar("F")

_OPTIONS: dict[str, Any] = {
    # Compiled code is kept on disk, so only the first call on a machine pays.
    "cache": True,
    # Batches run on plain threads.
    "nogil": True,
    "error_model": "numpy",
    # Kernels allocate nothing, so they need no reference counts; counting them took
    # two thirds of the time of a step.
    "_nrt": False,
    # Fused multiply-add only: no reordering, so NaN and inf keep their meaning.
    "fastmath": {"contract"},
}


def kernel(function: F) -> F:
    """Compile `function` with the project's numba options.

    The function must not allocate: working arrays are handed in by the caller.
    """
    return njit(**_OPTIONS)(function)  # pyright: ignore


def inlined(function: F) -> F:
    """As `kernel`, and melted into every caller: for what runs many times in a step."""
    return njit(forceinline=True, **_OPTIONS)(function)  # pyright: ignore
