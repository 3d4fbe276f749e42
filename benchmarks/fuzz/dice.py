"""Random choices, a microsecond each: a library that shrinks what it finds takes a thousand.

Every input has a seed and a number, by which it can be made again.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

from benchmarks.fuzz.hostile import HOSTILE

T = TypeVar("T")

_BLOCK = 64
_FLOATS = (
    0.0, -0.0, 1.0, -1.0, 0.1, 0.5, 1e-300, 5e-324, 2.2250738585072014e-308, 1e15, 1e300,
    1.7976931348623157e308, 1e-9, 3.5, 100.0, float("nan"), float("inf"), float("-inf"),
)  # fmt: skip
_WHOLES = (
    0, 1, -1, 2, 3, 10, 255, 256, 10**6, 2**31 - 1, 2**31, -(2**31) - 1, 2**32, 2**53 + 1,
    2**63 - 1, 2**63, -(2**63), -(2**63) - 1, 2**64, 10**18, 10**30, 10**308, 10**400, -(10**400),
)  # fmt: skip
_CHARACTERS = (
    (32, 126), (97, 122), (48, 57), (0, 31), (127, 160), (0x300, 0x6FF), (0x2000, 0x20FF),
    (0xD800, 0xDFFF), (0xFE00, 0xFFFF), (0x1F300, 0x10FFFF),
)  # fmt: skip


class Dice:
    """What one input is drawn with.

    Args:
        seed: of a run.
        number: of the input.
    """

    def __init__(self, seed: int, number: int) -> None:
        self.rng = np.random.default_rng([seed, number])
        self._left: list[float] = []

    def unit(self) -> float:
        """A number from 0 to 1."""
        if not self._left:
            self._left = self.rng.random(_BLOCK).tolist()
        return self._left.pop()

    def chance(self, share: float) -> bool:
        """Whether something of this probability happens."""
        return self.unit() < share

    def whole(self, low: int, high: int) -> int:
        """An integer between, both ends included."""
        return low + int(self.unit() * (high - low + 1))

    def pick(self, options: Sequence[T]) -> T:
        """One of them."""
        return options[int(self.unit() * len(options))]

    def binary(self, most: int, least: int = 0) -> bytes:
        """Random bytes."""
        return self.rng.bytes(self.whole(least, most))

    def text(self, most: int) -> str:
        """Letters, digits, and characters that no keyboard has."""
        spans = [self.pick(_CHARACTERS) for _ in range(self.whole(0, most))]
        return "".join(chr(self.whole(*span)) for span in spans)

    def number(self) -> float | int:
        """Of any size."""
        sort = self.whole(0, 5)
        if sort == 0:
            return self.pick(_FLOATS)
        if sort == 1:
            return struct.unpack("<d", self.rng.bytes(8))[0]
        if sort == 2:
            return self.pick(_WHOLES)
        if sort == 3:
            return self.whole(-1000, 1000)
        return (self.unit() - 0.5) * 10.0 ** self.whole(-8, 8)

    def value(self, depth: int = 2) -> Any:
        """Anything at all that Python code may pass."""
        sort = self.whole(0, 9 if depth else 6)
        if sort < 2:
            return self.number()
        if sort == 2:
            return self.pick((True, False, None))
        if sort == 3:
            return self.text(8)
        if sort < 6:
            return self.pick(HOSTILE)
        if sort == 6:
            return self.binary(4)
        inner = [self.value(depth - 1) for _ in range(self.whole(0, 4))]
        if sort == 7:
            return tuple(inner)
        return inner if sort == 8 else {self.text(4): each for each in inner}
