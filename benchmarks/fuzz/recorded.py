"""Harnesses of the readers of recordings: CSV, Parquet, MATLAB and the folder's manifest."""

from __future__ import annotations

import contextlib
import gzip
import io
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy.io import savemat

from benchmarks.fuzz.dice import Dice
from benchmarks.fuzz.hostile import HOSTILE
from benchmarks.fuzz.inputs import mutated
from benchmarks.fuzz.judge import Harness
from benchmarks.fuzz.reading import Reader
from drill_env.recordings import Recording, apart, limits, parse_map, read_folder
from drill_env.recordings.read import read_recording

ROWS = 30


def channels() -> dict[str, np.ndarray]:
    """A short clean recording."""
    t = np.arange(ROWS) / 100.0
    angle = np.round(3.0 * t + 0.2 * np.sin(7.0 * t), 6)
    return {"t": t, "u": np.round(2.0 + np.sin(9.0 * t), 4), "theta_u": angle, "theta_l": angle**2}


def csv_text(separator: str = ",", end: str = "\n", first: int = 4) -> bytes:
    """The same as CSV, the first columns of it."""
    columns = dict(list(channels().items())[:first])
    rows = [
        list(columns),
        *([repr(float(v)) for v in row] for row in zip(*columns.values(), strict=True)),
    ]
    return end.join(separator.join(row) for row in rows).encode() + end.encode()


def sane(recording: Recording) -> None:
    """What was accepted is within the limits."""
    assert limits.MOST_ROWS >= len(recording) >= 10
    assert (np.diff(recording.t) > 0).all() and recording.duration <= limits.LONGEST_DURATION
    assert np.median(np.diff(recording.t)) >= limits.SHORTEST_INTERVAL
    for name, values in recording.channels().items():
        known = values[np.isfinite(values)]
        key = "torque" if name == "u" and recording.drive == "torque" else name
        assert not np.isinf(values).any() and (np.abs(known) <= limits.LARGEST[key][0]).all()
    for angle in recording.angles().values():
        assert np.nanmax(angle) - np.nanmin(angle) <= limits.LARGEST_SPAN


MAPS = ((), ("theta_u=theta_u:counts/1e3",), ("t=t:ms",), ("u=u:1e300",), ("torque=u:0.05",),
        ("theta_u=m(2,:)", "u=s.a"), ("theta_l=c(1)",),
        ("omega_u=theta_u:rpm",), ("t=t:1e-300",),
        ("theta_u=theta_u@0.05", "u=u:2@-.003"), ("u=0", "theta_l=theta_l@1e9"))  # fmt: skip


def _read(path: Path, content: bytes, how: tuple[int, bool]) -> None:
    path.write_bytes(content)
    entries, keep = MAPS[how[0]], how[1]
    sane(read_recording(path, parse_map(entries), missing="keep" if keep else "refuse"))


def way(dice: Dice) -> tuple[int, bool]:
    """Place of the map of columns, and whether rows without a value are kept."""
    return dice.whole(0, len(MAPS) - 1), dice.chance(0.5)


def read_csv(folder: Path, given: tuple[bytes, bool, tuple[int, bool]]) -> None:
    """A text, gzipped first or not."""
    content, packed, how = given
    name = "run.csv.gz" if packed else "run.csv"
    _read(folder / name, gzip.compress(content, 1) if packed else content, how)


def read_packed(folder: Path, given: tuple[bytes, tuple[int, bool]]) -> None:
    """A gzip archive that was damaged itself."""
    _read(folder / "run.csv.gz", *given)


TEXTS = (csv_text(), csv_text(";", "\r\n"), csv_text("\t", "\r"), b"\xef\xbb\xbf# " + csv_text())
CSV = Harness(
    "csv", lambda dice: (mutated(dice, TEXTS, text=True), dice.chance(0.5), way(dice)), read_csv
)
BOMB = gzip.compress(b"t,u\n" * 10**6)
ARCHIVES = (gzip.compress(TEXTS[0]), gzip.compress(TEXTS[1], 0))


def archive(dice: Dice) -> tuple[bytes, tuple[int, bool]]:
    """A damaged one, or one of several members whose sums fit.

    Rarely one that unpacks to megabytes, which takes a hundred times as long.
    """
    if dice.chance(0.5):
        seeds = (BOMB,) if dice.chance(0.02) else ARCHIVES
        return mutated(dice, seeds, text=False), way(dice)
    text = dice.pick(TEXTS) if dice.chance(0.5) else mutated(dice, TEXTS, text=False)
    cuts = sorted(dice.whole(0, len(text)) for _ in range(dice.whole(0, 3)))
    edges = [0, *cuts, len(text)]
    members = [text[a:b] for a, b in zip(edges[:-1], edges[1:], strict=True)]
    return b"".join(gzip.compress(each, dice.whole(0, 2)) for each in members), way(dice)


GZIP = Harness("gzip", archive, read_packed)


_READER = Reader()


@contextlib.contextmanager
def read_in_turn() -> Iterator[None]:
    """Binary files by one child in turn: a process for each takes half a second."""
    with mock.patch.object(apart, "_run", _READER):
        yield


def read_binary(folder: Path, given: tuple[str, bytes, tuple[int, bool]]) -> None:
    """A Parquet, MATLAB or JSON file."""
    with read_in_turn():
        _read(folder / given[0], *given[1:])


KINDS = (
    pa.float64(), pa.float32(), pa.float16(), pa.int64(), pa.uint64(), pa.int8(), pa.bool_(),
    pa.string(), pa.binary(), pa.null(), pa.timestamp("ns"), pa.date32(), pa.time64("us"),
    pa.duration("s"), pa.decimal128(20, 3), pa.list_(pa.float64()), pa.large_string(),
    pa.struct([("a", pa.int8())]), pa.dictionary(pa.int8(), pa.string()),
)  # fmt: skip
PACKERS = ("none", "snappy", "zstd", "gzip")


NAMES = ("t", "u", "theta_u", "theta_l", "omega_u", "x", "")


def parquet(dice: Dice) -> bytes:
    """A valid Parquet file with columns of any kind."""
    names = [
        dice.pick(HOSTILE if dice.chance(0.1) else NAMES) for _ in range(dice.whole(1, 6))
    ]  # fmt: skip
    columns, clean = [], channels()
    for name in names:
        kind, values = dice.pick(KINDS), clean.get(name)
        if values is None or dice.chance(0.25):
            columns.append(pa.nulls(ROWS, kind))
            continue
        try:
            columns.append(pa.array(values).cast(kind, safe=False))
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError):
            columns.append(pa.array(values))
    out = io.BytesIO()
    try:
        pq.write_table(
            pa.Table.from_arrays(columns, names=names), out, compression=dice.pick(PACKERS)
        )
    except (pa.ArrowNotImplementedError, pa.ArrowInvalid):
        return parquet_seed()
    return out.getvalue()


def parquet_seed(**options: Any) -> bytes:
    """The clean recording."""
    out = io.BytesIO()
    pq.write_table(pa.table({**channels(), "word": ["a"] * ROWS}), out, **options)
    return out.getvalue()


PARQUET_SEEDS = (
    parquet_seed(compression="none"), parquet_seed(compression="zstd"),
    parquet_seed(compression="gzip", use_dictionary=False, data_page_version="2.0"),
)  # fmt: skip


def columnar(dice: Dice) -> tuple[str, bytes, tuple[int, bool]]:
    """A damaged Parquet file, or an odd one."""
    content = parquet(dice) if dice.chance(0.5) else mutated(dice, PARQUET_SEEDS, text=False)
    return "run.parquet", content, way(dice)


PARQUET = Harness("parquet", columnar, read_binary)


def mat_seed(**options: Any) -> bytes:
    """The clean recording with what else a workspace may hold."""
    out = io.BytesIO()
    others = {
        "s": {"a": 1.0, "b": "x"}, "c": np.array([1, "a"], dtype=object), "z": np.ones(3) * 1j,
        "gain": 0.5, "flag": True, "word": "abc", "m": np.ones((2, 3), dtype=np.int16),
    }  # fmt: skip
    savemat(out, {**channels(), **others}, **options)
    return out.getvalue()


MAT_SEEDS = (mat_seed(), mat_seed(do_compression=True), mat_seed(oned_as="row"))


def repacked(dice: Dice) -> bytes:
    """A MATLAB file damaged inside its compressed parts, whose sizes and sums fit again."""
    content = MAT_SEEDS[0]
    start = dice.pick((len(content) // 3, 128, 128 + 248))
    inside = mutated(dice, (content[128:], content[start:]), text=False)
    packed = zlib.compress(inside, 1)
    return content[:128] + np.array([15, len(packed)], "<i4").tobytes() + packed


def workspace(dice: Dice) -> tuple[str, bytes, tuple[int, bool]]:
    """A MATLAB file damaged outside or inside."""
    content = repacked(dice) if dice.chance(0.5) else mutated(dice, MAT_SEEDS, text=False)
    return "run.mat", content, way(dice)


MAT = Harness("mat", workspace, read_binary)


MANIFEST = b"""[defaults]
columns = { t = "t", u = "u", theta_u = "theta_u" }
units = { t = "s", theta_u = "counts", theta_l = "rad" }
counts_per_rev = 8192
[[recording]]
file = "run-*.csv"
role = "fit"
[[recording]]
file = "other.csv"
role = "holdout"
closed_loop = true
missing = "keep"
note = "none"
delay = { theta_u = 0.02, u = -0.013 }
interpolate = true
[[recording]]
files = { t = "time.csv", u = "time.csv", theta_l = "own.csv" }
delay = { theta_l = 0.003 }
interpolate = true
"""


def read_manifest(folder: Path, content: bytes) -> None:
    """A folder of small recordings with this manifest."""
    inside = folder / "set"
    inside.mkdir(exist_ok=True)
    for name, kept in (("run-1", 4), ("other", 4), ("time", 2), ("own", 4)):
        if not (inside / f"{name}.csv").exists():
            (inside / f"{name}.csv").write_bytes(csv_text(first=kept))
    (inside / "recordings.toml").write_bytes(content)
    found = read_folder(inside)
    for recording in (*found.stage1, *found.fit, *found.holdout):
        sane(recording)


FOLDER = Harness("manifest", lambda dice: mutated(dice, (MANIFEST,), text=True), read_manifest)
