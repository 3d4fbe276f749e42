"""A fleet: one table of rigs, bad ones among them, resumed, the same at any number of workers."""

from __future__ import annotations

import json
from datetime import date
from pathlib import Path

import pandas as pd
import pytest

from benchmarks.concealed.recordings import Hidden
from drill_env import Engine, InputError, Rig, load_rig, save_rig
from drill_env.cli.main import app
from drill_env.diagnosis.options import OUTSIDE, DiagnosisOptions
from drill_env.diagnosis.since import Since, onset
from drill_env.effects import LIBRARY
from drill_env.fleet import FleetSettings, run_fleet
from drill_env.recordings import read_folder
from tests.made_recordings import made

RIG = Rig().replace(km=3.66)
SHAKEN = (Hidden("unbalance", {"torque": 0.005, "phase": 0.7}),)
LEFT_OUT = tuple(n for n in (*LIBRARY, *OUTSIDE) if n != "unbalance")
SETTINGS = FleetSettings(options=DiagnosisOptions(leave_out=LEFT_OUT, most=1))
OPTIONS = [f"--leave-out={name}" for name in LEFT_OUT] + ["--most", "1"]


def write(path: Path, hidden: tuple[Hidden, ...], seed: int) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    run = made(RIG, hidden, (7, seed), seconds=12.0)
    pd.DataFrame({"t": run.t, **run.channels()}).to_csv(path, index=False)


@pytest.fixture(scope="module")
def rigs(tmp_path_factory) -> Path:
    """A sound rig, one that began to shake in February, and one whose recording is broken."""
    folder = tmp_path_factory.mktemp("rigs")
    write(folder / "a sound one" / "fit-1.csv", (), 1)
    write(folder / "a sound one" / "hold-1.csv", (), 2)
    save_rig(Rig(), folder / "a sound one" / "rig.toml")
    for month, role, hidden in ((1, "fit", ()), (2, "fit", SHAKEN), (3, "hold", SHAKEN)):
        write(folder / "shaken" / f"{role}-2026-0{month}-10.csv", hidden, month)
    (folder / "broken").mkdir()
    (folder / "broken" / "fit-1.csv").write_text("t,u\n0,zero\n")
    (folder / "notes.txt").write_text("no rig")
    return folder


@pytest.fixture(scope="module")
def out(rigs, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("fleet")
    fleet = run_fleet(rigs, folder, SETTINGS)
    assert (fleet.kept, fleet.faults, fleet.stale) == ((), (), ())
    return folder


def test_the_table_says_what_is_missing_since_when_and_what_was_wrong(rigs, out):
    table = pd.read_csv(out / "fleet.csv").set_index("rig")
    assert table.index.tolist() == ["a sound one", "broken", "shaken"]
    sound, broken, shaken = (table.loc[name] for name in table.index)
    assert sound.verdict == "parameters" and sound.numbers.startswith("km 3.6")
    assert "given 3.569" in sound.numbers and pd.isna(sound.missing)
    assert broken.error.startswith("fit-1.csv") and pd.isna(broken.verdict)
    assert (shaken.verdict, shaken.missing, shaken.component) == (
        "missing_physics", "unbalance", "lower"
    )  # fmt: skip
    assert shaken.probability > 0.9 and "unbalance torque" in shaken.numbers
    assert (shaken.since, shaken.last_without) == ("2026-02-10", "2026-01-10")
    assert (table.cpu_s.dropna() > 0.0).all() and table.error.notna().sum() == 1
    report = json.loads((out / "rigs" / "shaken" / "diagnosis.json").read_text())
    assert report["effects"][0]["id"] == "unbalance"
    assert load_rig(out / "rigs" / "shaken" / "rig-extended.toml").effects
    assert (out / "rigs" / "shaken" / "index.html").is_file()
    assert not (out / "rigs" / "broken").exists()


def without_time(path: Path) -> pd.DataFrame:
    return pd.read_parquet(path, partitioning=None).drop(columns="cpu_s")


def test_two_workers_give_the_same_to_the_last_bit(rigs, out, tmp_path):
    run_fleet(rigs, tmp_path, SETTINGS, engine=Engine(jobs=2))
    for file in ("diagnosis.json", "rig-extended.toml", "index.html"):
        for rig in ("a sound one", "shaken"):
            one, other = (folder / "rigs" / rig / file for folder in (out, tmp_path))
            assert one.read_bytes() == other.read_bytes()
    one, other = (without_time(folder / "fleet.parquet") for folder in (out, tmp_path))
    assert one.astype(str).equals(other.astype(str))


def test_only_what_changed_is_done_again(rigs, out, capsys):
    parts = sorted((out / "parts").glob("rig=*/part.parquet"))
    assert len(parts) == 3
    times = {p: p.stat().st_mtime_ns for p in parts}
    command = ["fleet", str(rigs), "--out", str(out), "--jobs", "1", *OPTIONS]
    app([*command, "--json"], standalone_mode=False)
    told = json.loads(capsys.readouterr().out)
    assert told["kept"] == ["a sound one", "shaken"]
    assert [row["name"] for row in told["rigs"]] == ["a sound one", "broken", "shaken"]
    assert told["rigs"][2]["since"] == "2026-02-10" and told["rigs"][1]["verdict"] is None
    assert [p.parent.name for p in parts if p.stat().st_mtime_ns != times[p]] == ["rig=broken"]
    write(rigs / "broken" / "fit-1.csv", (), 9)
    (rigs / "shaken").rename(rigs / "quaking")
    app(command, standalone_mode=False)
    shown = capsys.readouterr()
    assert "consistent" in shown.out and "unbalance" in shown.out
    assert "1 done before, 0 with errors" in shown.err and "gone: shaken" in shown.err
    table = pd.read_parquet(out / "fleet.parquet")
    assert table.rig.tolist() == ["a sound one", "broken", "quaking"]


def test_parts_are_read_as_one_table(out):
    parts = pd.read_parquet(out / "parts")
    assert set(parts.rig) == set(parts.name) >= {"a sound one", "broken", "shaken"}
    assert str(parts.since.dropna().iloc[0]) == "2026-02-10"


def test_parts_are_read_by_polars(out):
    polars = pytest.importorskip("polars", reason="polars is not installed")
    parts = polars.read_parquet(out / "parts" / "**" / "*.parquet", hive_partitioning=True)
    assert set(parts["rig"]) == set(parts["name"]) >= {"a sound one", "broken", "shaken"}
    assert parts["since"].drop_nulls()[0] == date(2026, 2, 10)


def test_parts_are_read_by_duckdb(out):
    duckdb = pytest.importorskip("duckdb", reason="duckdb is not installed")
    glob = f"{out}/parts/**/*.parquet"
    found = duckdb.sql(
        "select rig, name, since, unnest(parameters, recursive := true) "
        f"from read_parquet('{glob}', hive_partitioning = true) where rig = 'shaken'"
    ).fetchall()
    assert [row[:4] for row in found] == [
        ("shaken", "shaken", date(2026, 2, 10), "unbalance")
    ] * 2  # fmt: skip


def test_a_fault_of_ours_stops_no_other_rig_and_is_told(rigs, tmp_path, monkeypatch, capsys):
    import drill_env.fleet.rig as rig_module

    def fails(*args: object, **options: object) -> None:
        raise ZeroDivisionError("by a test")

    monkeypatch.setattr(rig_module, "diagnose", fails)
    command = ["fleet", str(rigs), "--out", str(tmp_path), "--jobs", "1"]
    assert app(command, standalone_mode=False) == 1
    assert "a fault of ours in a sound one" in capsys.readouterr().err
    errors = pd.read_csv(tmp_path / "fleet.csv", index_col="rig").error
    # Other tests rename the third rig, and mend the broken one.
    sound = errors.drop("broken")
    assert len(sound) == 2
    assert sound.str.contains("ZeroDivisionError: by a test").all()


@pytest.mark.parametrize(
    ("gains", "found"),
    [
        ([-50.0, -40.0, 60.0, 80.0], Since(date(2026, 3, 1), date(2026, 2, 1))),
        ([-50.0, 3.0, 60.0, 80.0], Since(date(2026, 3, 1), date(2026, 1, 1))),
        ([30.0, 3.0, 60.0], Since(date(2026, 1, 1), None)),
        ([30.0, -40.0, 60.0], None),
        ([3.0, 2.0], None),
        ([90.0], None),
    ],
)
def test_an_effect_begins_between_the_last_day_without_and_the_first_with_it(gains, found):
    days = {date(2026, month, 1): gain for month, gain in enumerate(gains, 1)}
    assert onset(days, 15.0) == found


def test_dates_come_from_the_manifest_or_the_name(tmp_path):
    for name in ("a-20260131.csv", "b-2026-02-30.csv", "hold.csv"):
        write(tmp_path / name, (), 1)
    manifest = tmp_path / "recordings.toml"
    entries = ['file = "a*"', 'file = "b*"', 'file = "hold.csv"\ndate = 2026-05-01T10:00:00']
    manifest.write_text("".join(f"[[recording]]\n{entry}\n" for entry in entries))
    dates = [told.date for told in read_folder(tmp_path).settings.values()]
    assert dates == [date(2026, 1, 31), None, date(2026, 5, 1)]
    manifest.write_text('[[recording]]\nfile = "a*"\ndate = "May"\n')
    with pytest.raises(InputError, match="date is 'May'; write date = 2026-01-31"):
        read_folder(tmp_path)


@pytest.mark.parametrize(
    ("folder", "out", "text"),
    [
        ("none", "out", "no such folder"),
        ("empty", "out", "no folders in it"),
        ("full", "full/rig", "lies in a rig's folder"),
        ("full", "full", "is the folder of the rigs"),
    ],
)
def test_bad_folders_are_named_and_nothing_is_written(tmp_path, folder, out, text):
    (tmp_path / "empty").mkdir()
    (tmp_path / "full" / "rig").mkdir(parents=True)
    with pytest.raises(InputError, match=text):
        run_fleet(tmp_path / folder, tmp_path / out)
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["empty", "full", "rig"]
