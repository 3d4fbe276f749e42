"""A short seeded run of every fuzz harness; the long one is `make fuzz`."""

from __future__ import annotations

import os

import pytest

from benchmarks.fuzz.dice import Dice
from benchmarks.fuzz.harnesses import HARNESSES
from benchmarks.fuzz.judge import Failed, Hang, Harness, fuzz
from benchmarks.fuzz.reading import Child, Reader
from drill_env import InputError
from drill_env.recordings import _read_apart, apart

INPUTS = 500


@pytest.mark.parametrize("name", HARNESSES)
def test_hostile_input_is_read_or_refused_by_one_line(name, tmp_path):
    """The harness raises what the reader let through, and checks what it accepted."""
    tally = fuzz(HARNESSES[name], tmp_path, INPUTS, seed=20)
    assert tally.tried == INPUTS and tally.reasons and tally.accepted


@pytest.mark.parametrize("name", HARNESSES)
def test_an_input_can_be_made_again(name):
    draw = HARNESSES[name].inputs
    assert repr(draw(Dice(3, 7))) == repr(draw(Dice(3, 7)))


def never(folder, given):
    while True:
        pass


def lets_through(folder, given):
    raise KeyError(given)


@pytest.mark.parametrize(("read", "why"), [(never, Hang), (lets_through, KeyError)])
def test_what_fails_is_told_with_its_number(read, why, tmp_path, monkeypatch):
    monkeypatch.setattr("benchmarks.fuzz.judge.LONGEST", 0.1)
    with pytest.raises(Failed, match="odd, seed 4, input 9: ") as told:
        fuzz(Harness("odd", Dice.unit, read), tmp_path, 3, seed=4, first=9)
    assert isinstance(told.value.__cause__, why)


def test_a_reader_that_crashes_takes_no_other_file_with_it(tmp_path, monkeypatch):
    """A file that ends a used child is read again by a fresh one, where it may be right."""

    def main(kind, path, given, wanted):
        first = not (tmp_path / "seen").exists()
        (tmp_path / "seen").touch()
        if path.stem == "bad" or (path.stem == "odd" and first):
            os.kill(os.getpid(), 11)
        print(path.stem, flush=True)
        return 0

    monkeypatch.setattr(_read_apart, "main", main)
    reader = Reader()
    assert reader(tmp_path / "odd.mat", "mat", ()) == b"odd\n"
    with pytest.raises(InputError, match="not a whole MATLAB file"):
        reader(tmp_path / "bad.mat", "mat", ())
    assert reader(tmp_path / "good.mat", "mat", ()) == b"good\n"


def test_a_child_ends_though_a_later_one_holds_its_pipe():
    """That waited for ever."""
    first, later = Child(), Child()
    for child in (first, later):
        child.close()
        with pytest.raises(ProcessLookupError):
            os.kill(child.pid, 0)


def test_the_child_reads_what_the_program_reads(tmp_path):
    from benchmarks.fuzz.recorded import parquet_seed

    path = tmp_path / "a.parquet"
    path.write_bytes(parquet_seed())
    assert Reader()(path, "parquet", ()) == apart._run(path, "parquet", ()) != b""
