"""Damaged and hostile files: seeds with bytes flipped, cut, repeated, or numbers replaced."""

from __future__ import annotations

import re

from hypothesis import strategies as st

HOSTILE = (
    "nan", "-nan", "inf", "-inf", "1e400", "-1e400", "1e308", "1e300", "1e-300", "1e15", "1e14",
    "9e5", "-1e9", "1e99999", "5e-324", "-0.0", "0", "-1", "0x10", "0b1", "1_000", "9" * 30,
    "9" * 400, "1" + "0" * 5000, "", " ", "true", "null", "None", "[]", "{}", "[[]]", '""', '"',
    "'", "''", ",", ";", "\t", "\r", "\n", "\r\n", "\x00", "\ufeff", "\u0663", "\u00b5s", "1,5",
    "2020-01-01", "12:30:00", "2020-01-01T00:00:00Z", "=1+1", "<script>", "../x", "a**.csv", "**",
    "\x1b[31m", "\u202e", "counts/0", "counts/1e308", "[", "]" * 50, "[" * 2000, "{" * 500, "#",
)  # fmt: skip
"""What a cell, a value or a name may never be."""

_NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
_WORD = re.compile(rb'"[^"\n]*"|[A-Za-z_]\w*')


@st.composite
def mutated(draw: st.DrawFn, seeds: tuple[bytes, ...], *, text: bool) -> bytes:
    """A seed with one to six damages.

    Args:
        draw: of hypothesis.
        seeds: valid files.
        text: whether numbers and words may be replaced, not bytes alone.
    """
    content = draw(st.sampled_from(seeds))
    kinds = ["flip", "flip", "cut", "drop", "repeat", "insert", "fill"]
    kinds += ["number", "number", "number", "word"] * 6 if text else []
    for _ in range(draw(st.sampled_from([1, 1, 1, 2, 2, 3, 6]))):
        content = _damaged(draw, content, draw(st.sampled_from(kinds)))
    return content


def _damaged(draw: st.DrawFn, content: bytes, kind: str) -> bytes:
    if kind in ("number", "word"):
        found = list((_NUMBER if kind == "number" else _WORD).finditer(content))
        if not found:
            return content
        place = draw(st.sampled_from(found))
        new = draw(st.sampled_from(HOSTILE)).encode("utf-8", "surrogatepass")
        return content[: place.start()] + new + content[place.end() :]
    at = draw(st.integers(0, max(len(content) - 1, 0)))
    length = draw(st.integers(1, 64))
    if kind == "flip":
        new = bytes([draw(st.integers(0, 255))])
        return content[:at] + new + content[at + 1 :]
    if kind == "cut":
        return content[:at]
    if kind == "drop":
        return content[:at] + content[at + length :]
    if kind == "repeat":
        return content[:at] + content[at : at + length] * draw(st.integers(2, 50)) + content[at:]
    if kind == "fill":
        return content[:at] + b"\xff" * min(length, 8) + content[at + min(length, 8) :]
    return content[:at] + draw(st.binary(min_size=1, max_size=16)) + content[at:]


numbers = st.one_of(
    st.floats(), st.integers(), st.integers(-(10**400), 10**400), st.sampled_from([1e300, 5e-324])
)
"""Numbers of any size."""

values = st.recursive(
    st.one_of(
        numbers, st.booleans(), st.none(), st.text(max_size=8), st.sampled_from(HOSTILE),
        st.binary(max_size=4),
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4), st.dictionaries(st.text(max_size=4), inner, max_size=3)
    ),
    max_leaves=6,
)  # fmt: skip
"""Anything at all that Python code may pass."""
