"""Damaged files: seeds with bytes flipped, cut, repeated, or numbers and words replaced."""

from __future__ import annotations

import re

from benchmarks.fuzz.dice import Dice
from benchmarks.fuzz.hostile import HOSTILE

_NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
_WORD = re.compile(rb'"[^"\n]*"|[A-Za-z_]\w*')
_BYTES = ("flip", "flip", "cut", "drop", "repeat", "insert", "fill")
_TEXT = (*_BYTES, *("number", "number", "number", "word") * 6)
_TIMES = (1, 1, 1, 2, 2, 3, 6)


def mutated(dice: Dice, seeds: tuple[bytes, ...], *, text: bool) -> bytes:
    """A seed with one to six damages.

    Args:
        dice: what decides.
        seeds: valid files.
        text: whether numbers and words may be replaced, not bytes alone.
    """
    content = dice.pick(seeds)
    for _ in range(dice.pick(_TIMES)):
        content = _damaged(dice, content, dice.pick(_TEXT if text else _BYTES))
    return content


def _damaged(dice: Dice, content: bytes, kind: str) -> bytes:
    if kind in ("number", "word"):
        found = list((_NUMBER if kind == "number" else _WORD).finditer(content))
        if not found:
            return content
        place = dice.pick(found)
        new = dice.pick(HOSTILE).encode("utf-8", "surrogatepass")
        return content[: place.start()] + new + content[place.end() :]
    # Headers are short and decide most: half of the damages fall near one end.
    last = max(len(content) - 1, 0)
    low, high = dice.pick(((0, last), (0, last), (0, min(200, last)), (max(last - 200, 0), last)))
    at = dice.whole(low, high)
    length = dice.whole(1, 64)
    if kind == "flip":
        return content[:at] + bytes([dice.whole(0, 255)]) + content[at + 1 :]
    if kind == "cut":
        return content[:at]
    if kind == "drop":
        return content[:at] + content[at + length :]
    if kind == "repeat":
        return content[:at] + content[at : at + length] * dice.whole(2, 50) + content[at:]
    if kind == "fill":
        return content[:at] + b"\xff" * min(length, 8) + content[at + min(length, 8) :]
    return content[:at] + dice.binary(16, 1) + content[at:]
