"""Folders of recordings: roles, units, gaps, and every bad manifest named."""

from __future__ import annotations

import warnings

import numpy as np
import pandas as pd
import pytest

from drill_env import InputError
from drill_env.cli._recordings import read_set
from drill_env.recordings import RecordingWarning, parse_map, read_folder, read_recording

STEP = 2 * np.pi / 8192


def columns(seed=0, rows=1500, rate=200.0):
    t = np.arange(rows) / rate
    rng = np.random.default_rng(seed)
    theta_u = np.round((3.0 * t + 0.5 * np.sin(0.9 * t + rng.uniform(0, 6))) / STEP) * STEP
    theta_l = np.round((3.0 * t + 0.4 * np.sin(1.53 * t)) / STEP) * STEP
    return {"t": t, "u": 2 + np.sin(0.7 * t), "theta_u": theta_u, "theta_l": theta_l}


def write(folder, name, table):
    pd.DataFrame(table).to_csv(folder / name, index=False)


@pytest.fixture
def folder(tmp_path):
    for number, name in enumerate(("a.csv", "b1.csv", "b2.csv.gz", "c.csv")):
        c = columns(number)
        raw = {
            "ms": 1e3 * c["t"], "drive": c["u"], "top": np.round(c["theta_u"] / STEP).astype(int),
            "bottom": np.degrees(c["theta_l"]),
        }  # fmt: skip
        write(tmp_path, name, raw)
    return tmp_path


MANIFEST = """
[defaults]
columns = { t = "ms", u = "drive", theta_u = "top", theta_l = "bottom" }
units = { t = "ms", theta_u = "counts", theta_l = "deg" }
counts_per_rev = 8192

[[recording]]
file = "a.csv"
role = "stage1"
note = "belt off"

[[recording]]
file = "b*"

[[recording]]
file = "c.csv"
role = "holdout"
units = { u = "2" }
closed_loop = true
"""


def test_a_manifest_sorts_maps_and_scales(folder):
    (folder / "recordings.toml").write_text(MANIFEST)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = read_folder(folder)
        again = read_folder(folder / "recordings.toml")
    assert [r.source for r in found.fit] == [r.source for r in again.fit]
    assert [len(g) for g in (found.stage1, found.fit, found.holdout)] == [1, 2, 1]
    for number, recording in enumerate((*found.stage1, *found.fit, *found.holdout)):
        truth = columns(number)
        np.testing.assert_allclose(recording.t, truth["t"], atol=1e-12)
        np.testing.assert_allclose(recording.theta_u, truth["theta_u"], atol=1e-9)
        np.testing.assert_allclose(recording.theta_l, truth["theta_l"], atol=1e-9)
        np.testing.assert_allclose(recording.u, truth["u"] * (2 if number == 3 else 1), atol=1e-12)
    assert found.of(found.stage1[0]).note == "belt off"
    assert [found.of(r).closed_loop for r in (*found.fit, *found.holdout)] == [False, False, True]


def test_a_manifest_may_give_a_number_for_the_drive(folder):
    (folder / "recordings.toml").write_text(MANIFEST.replace('u = "drive"', "u = 0"))
    found = read_folder(folder)
    assert not any(recording.u.any() for recording in (*found.stage1, *found.fit))
    (folder / "recordings.toml").write_text(MANIFEST.replace('u = "drive"', "u = true"))
    with pytest.raises(InputError, match="columns.u is True; write a name in quotes"):
        read_folder(folder)


def test_without_a_manifest_names_tell_the_role_and_a_message_says_so(tmp_path):
    for name in ("fit-1.csv", "holdout-1.csv", "stage1.csv", "other.csv"):
        write(tmp_path, name, columns())
    (tmp_path / "notes.md").write_text("x")
    with pytest.warns(RecordingWarning, match="no recordings.toml.*1 stage1, 2 fit, 1 holdout"):
        found = read_folder(tmp_path)
    assert [r.source[-9:] for r in found.fit] == ["fit-1.csv", "other.csv"]


BAD = {
    "no TOML": ("file = ", "not TOML"),
    "no entries": ("[defaults]\n", r"write one table \[\[recording\]\]"),
    "top key": ("recordings = 1", "unknown key recordings; known: defaults, recording"),
    "key": ('[[recording]]\nfile="a.csv"\nrol="fit"', "number 1: unknown key rol; known: file"),
    "default": ('[defaults]\nfile="a"\n[[recording]]\nfile="a.csv"', "unknown key file"),
    "no file": ("[[recording]]\nrole='fit'", "number 1: no file; write file"),
    "missing file": ('[[recording]]\nfile="z.csv"', "no file .*z.csv; check the name"),
    "absolute": ('[[recording]]\nfile="/z.csv"', "absolute"),
    "twice": ('[[recording]]\nfile="a.csv"\n[[recording]]\nfile="a*"', "a.csv is named before"),
    "role": ('[[recording]]\nfile="a.csv"\nrole="test"', "a.csv: unknown role 'test'; known: sta"),
    "channel": ('[[recording]]\nfile="a.csv"\ncolumns={v="x"}', "a.csv: columns: unknown key v"),
    "column": ('[[recording]]\nfile="a.csv"\ncolumns={t="time"}', "a.csv: no column time; found"),
    "type": ('[[recording]]\nfile="a.csv"\nunits={t=3}', "units.t is 3; write a name in quotes"),
    "table": ('[[recording]]\nfile="a.csv"\nunits="ms"', "units is no table"),
    "unit": ('[[recording]]\nfile="a.csv"\nunits={t="h"}', "unknown unit 'h' of t; known: s, ms"),
    "volt counts": (
        '[[recording]]\nfile="a.csv"\nunits={u="counts"}',
        "unknown unit 'counts' of u",
    ),
    "no counts": (
        '[[recording]]\nfile="a.csv"\nunits={theta_u="counts"}',
        "counts_per_rev is not given; add it",
    ),
    "counts": ('[[recording]]\nfile="a.csv"\ncounts_per_rev=0', "counts_per_rev is 0; give"),
    "loop": ('[[recording]]\nfile="a.csv"\nclosed_loop="yes"', "closed_loop is 'yes'; give true"),
    "missing": ('[[recording]]\nfile="a.csv"\nmissing="cut"', "unknown missing 'cut'; known: ref"),
}


@pytest.mark.parametrize("kind", BAD)
def test_bad_manifests_give_one_clear_error(folder, kind):
    text, message = BAD[kind]
    (folder / "recordings.toml").write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_folder(folder)
    assert str(folder) in str(caught.value)


def test_folders_without_recordings_give_one_clear_error(tmp_path):
    with pytest.raises(InputError, match="no recordings"):
        read_folder(tmp_path)
    with pytest.raises(InputError, match="no such folder"):
        read_folder(tmp_path / "x")
    write(tmp_path, "fit.csv", {k: v for k, v in columns().items() if not k.startswith("theta")})
    with pytest.warns(RecordingWarning), pytest.raises(InputError, match="neither theta_u nor"):
        read_folder(tmp_path)


def test_a_stage_1_recording_needs_the_upper_encoder(tmp_path):
    write(tmp_path, "stage1.csv", {k: v for k, v in columns().items() if k != "theta_u"})
    with pytest.warns(RecordingWarning), pytest.raises(InputError, match="no column theta_u"):
        read_folder(tmp_path)


def test_missing_samples_are_kept_as_nan_and_lost_rows_as_gaps(tmp_path):
    truth = columns(rows=3000)
    table = {name: values.copy() for name, values in truth.items()}
    table["theta_l"][400:700] = np.nan
    table["u"][1200:1300] = np.nan
    kept = np.r_[0:2000, 2400:3000]
    write(tmp_path, "run.csv", {name: values[kept] for name, values in table.items()})
    with pytest.raises(InputError, match="300 missing|100 missing"):
        read_recording(tmp_path / "run.csv")
    with pytest.warns(RecordingWarning) as caught:
        recording = read_recording(tmp_path / "run.csv", missing="keep")
    assert [w.message.code for w in caught] == ["missing", "gap"]
    rows = np.r_[0:1200, 1300:2000, 2400:3000]
    np.testing.assert_array_equal(recording.t, truth["t"][rows])
    np.testing.assert_array_equal(recording.u, truth["u"][rows])
    np.testing.assert_array_equal(recording.theta_u, truth["theta_u"][rows])
    assert np.flatnonzero(np.isnan(recording.theta_l)).tolist() == list(range(400, 700))
    assert recording.quanta["theta_l"] == pytest.approx(STEP, rel=1e-6)
    assert recording.gaps.tolist() == [1199, 1899]
    assert [len(part) for part in recording.stretches()] == [1200, 700, 600]


def test_irregular_sampling_is_read_as_it_is(tmp_path):
    rng = np.random.default_rng(2)
    c = columns(rows=4000)
    kept = np.sort(rng.choice(4000, 2500, replace=False))
    write(tmp_path, "run.csv", {name: values[kept] for name, values in c.items()})
    with pytest.warns(RecordingWarning, match="gaps, about"):
        recording = read_recording(tmp_path / "run.csv")
    np.testing.assert_array_equal(recording.t, c["t"][kept])
    np.testing.assert_array_equal(recording.theta_l, c["theta_l"][kept])
    assert list(recording.quanta.values()) == pytest.approx([STEP, STEP], rel=1e-6)


MAP = ("t=ms:ms", "u=drive", "theta_u=top:counts/8192", "theta_l=bottom:deg")


def test_one_map_names_the_columns_of_a_folder_without_a_manifest(folder):
    (folder / "c.csv").rename(folder / "hold.csv")
    with pytest.warns(RecordingWarning, match="1 holdout"):
        found = read_set([folder], MAP)
    assert [len(found.fit), len(found.holdout)] == [3, 1]
    expected = columns(3)
    assert found.holdout[0].t == pytest.approx(expected["t"], abs=1e-9)
    assert found.holdout[0].theta_u == pytest.approx(expected["theta_u"], abs=1e-9)


def test_a_manifest_and_a_map_are_not_mixed(folder):
    (folder / "recordings.toml").write_text(MANIFEST)
    with pytest.raises(InputError, match="put what --map says under columns"):
        read_folder(folder, columns=parse_map(MAP))
