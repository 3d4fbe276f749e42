"""Recordings: what is read, and that every kind of bad recording is named."""

from __future__ import annotations

import gzip
import math
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from drill_env import InputError
from drill_env.recordings import RecordingWarning, encoder_step, parse_map, read_recording

SHARED = Path(__file__).resolve().parents[2] / "shared" / "recordings"
needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="no recordings beside the checkout")
STEP = 2 * math.pi / 8192


def clean(rows=2000, rate=200.0):
    t = np.arange(rows) / rate
    theta_u = 3.0 * t + 0.5 * np.sin(0.9 * t)
    theta_l = theta_u - 0.4 * np.sin(1.53 * t)
    u = 2.0 + 1.5 * np.sin(0.7 * t) + 0.3 * np.sin(3.1 * t)
    return {"t": t, "u": u, "theta_u": theta_u, "theta_l": theta_l}


def write(tmp_path, columns, name="run.csv"):
    path = tmp_path / name
    pd.DataFrame(columns).to_csv(path, index=False)
    return path


def read_quietly(path, *maps, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return read_recording(path, parse_map(maps), **options)


def test_every_format_gives_the_same_exact_recording(tmp_path):
    columns = clean() | {"temperature": np.linspace(20, 21, 2000)}
    paths = [write(tmp_path, columns), write(tmp_path, columns, "run.csv.gz")]
    paths += [tmp_path / "run.parquet", tmp_path / "run.mat"]
    pd.DataFrame(columns).to_parquet(paths[2])
    savemat(paths[3], {k: v[:, None] for k, v in columns.items()} | {"gain": 3.5})
    for path in paths:
        recording = read_quietly(path)
        for name, values in recording.channels().items():
            np.testing.assert_array_equal(values, columns[name])
        np.testing.assert_array_equal(recording.extra["temperature"], columns["temperature"])
        assert recording.rate == pytest.approx(200.0)
        assert recording.notes == ()
    assert recording.constant("gain") == 3.5


def test_units_and_names_are_mapped_to_si(tmp_path):
    truth = clean()
    path = write(
        tmp_path,
        {
            "time_ms": 1e3 * truth["t"],
            "drive": 1e3 * truth["u"],
            "enc:1": np.round(truth["theta_u"] / STEP).astype(int),
            "pos": np.degrees(truth["theta_l"]),
        },
    )
    maps = ["t=time_ms:ms", "u=drive:-1e-3", "theta_u=enc:1:counts/8192", "theta_l=pos:deg"]
    recording = read_quietly(path, *maps)
    np.testing.assert_allclose(recording.t, truth["t"], atol=1e-12)
    np.testing.assert_allclose(recording.u, -truth["u"], atol=1e-12)
    np.testing.assert_allclose(recording.theta_u, truth["theta_u"], atol=0.51 * STEP)
    np.testing.assert_allclose(recording.theta_l, truth["theta_l"], atol=1e-12)
    assert recording.quanta["theta_u"] == pytest.approx(STEP, rel=1e-9)


@pytest.mark.parametrize("slow", [0.02, 3.0, 60.0])
def test_encoder_step_is_found_through_the_rounding_of_the_file(slow):
    t = np.arange(4000) / 200
    theta = slow * t + 0.3 * np.sin(t)
    counted = np.round(np.round(theta / STEP) * STEP, 6)
    assert encoder_step(counted) == pytest.approx(STEP, rel=1e-5)
    assert encoder_step(theta) is None
    assert encoder_step(np.round(theta, 3)) is None


def _row(name, index, value):
    def change(c):
        values = c[name].astype(object)
        values[index] = value
        return {**c, name: values}

    return change


def _time(function):
    return lambda c: {**c, "t": function(c["t"].copy())}


ERRORS = {
    "backwards": (
        _time(lambda t: t[np.r_[:7, 8, 7, 9 : len(t)]]),
        "column t runs backwards in row 10",
    ),
    "repeated": (_time(lambda t: t[np.r_[:8, 7, 9 : len(t)]]), "column t repeats in row 10"),
    "clock in ms": (_time(lambda t: 1e3 * t), "probably in ms: --map t=t:ms"),
    "clock in us": (_time(lambda t: 1e6 * t), "probably in us"),
    "nan": (_row("theta_l", 30, np.nan), "theta_l has 1 missing.*row 32"),
    "inf": (_row("u", 30, np.inf), "column u has 1 missing.*row 32"),
    "truncated row": (_row("theta_l", -1, np.nan), "last row .2001.: the file looks truncated"),
    "words": (_row("u", 3, "off"), "column u is not numeric: 'off' in row 5"),
    "comma": (_row("u", 3, "1,5"), "'1,5' in row 5; write decimals with a point"),
    "short": (lambda c: {k: v[:5] for k, v in c.items()}, "only 5 rows"),
    "no rows": (lambda c: {k: v[:0] for k, v in c.items()}, "no rows|only 0 rows"),
    "no time": (lambda c: {k: v for k, v in c.items() if k != "t"}, "no column t; found: u, th"),
    "no voltage": (lambda c: {k: v for k, v in c.items() if k != "u"}, "no column u; found: t,"),
    "counts": (
        lambda c: {**c, "theta_u": np.round(c["theta_u"] / STEP).astype(int)},
        "look like encoder counts.*--map theta_u=theta_u:counts/8192",
    ),
}


@pytest.mark.parametrize("kind", ERRORS)
def test_bad_recordings_give_one_clear_error(tmp_path, kind):
    change, message = ERRORS[kind]
    path = write(tmp_path, change(clean()))
    with pytest.raises(InputError, match=message) as caught:
        read_quietly(path, need=("u",))
    assert str(path) in str(caught.value)


def _jitter(t):
    return t + np.random.default_rng(1).uniform(-1e-3, 1e-3, len(t))


WARNINGS = {
    "jitter": (_time(_jitter), "jitter", r"sampling jitter 1\d\.\d %"),
    "slow": (_time(lambda t: 20 * t), "slow_clock", "0.1 s between samples is slow.*t=t:ms"),
    "gap": (
        _time(lambda t: t + 0.1 * (t > 4.4975)),
        "gap",
        "1 gaps, about 20 samples lost.*row 901",
    ),
    "constant voltage": (lambda c: {**c, "u": 0 * c["u"] + 3}, "constant", "u is constant at 3 V"),
    "dead encoder": (lambda c: {**c, "theta_l": 0 * c["t"]}, "constant", "encoder is dead"),
    "clipped voltage": (
        lambda c: {**c, "u": np.minimum(2 * np.sin(2 * c["t"]) + np.sin(0.3 * c["t"]), 1.8)},
        "saturated",
        "u sits at its maximum 1.8 V",
    ),
    "clipped angle": (
        lambda c: {**c, "theta_u": np.minimum(c["theta_u"], 20.0)},
        "saturated",
        "stops dead at its maximum 20",
    ),
    "millivolts": (lambda c: {**c, "u": 1e3 * c["u"]}, "large_voltage", "--map u=u:mV"),
    "degrees": (
        lambda c: {**c, "theta_u": np.degrees(c["theta_u"])},
        "implausible_speed",
        "--map theta_u=theta_u:deg",
    ),
    "glitch": (
        lambda c: {**c, "theta_l": c["theta_l"] + 2.0 * (c["t"] > 4.9975)},
        "jump",
        "in row 1002",
    ),
    "words": (lambda c: {**c, "remark": "x"}, "ignored_column", "remark"),
}


@pytest.mark.parametrize("kind", WARNINGS)
def test_doubtful_recordings_give_one_named_warning(tmp_path, kind):
    change, code, message = WARNINGS[kind]
    path = write(tmp_path, change(clean()))
    with pytest.warns(RecordingWarning, match=message) as caught:
        recording = read_recording(path)
    assert [w.message.code for w in caught] == [code]
    assert recording.has_note(code)


@pytest.mark.parametrize("fold", [lambda a: a % (2 * np.pi), lambda a: (a + 9) % (2 * np.pi) - 3])
def test_wrapped_angles_are_unwrapped(tmp_path, fold):
    truth = clean()
    path = write(tmp_path, {**truth, "theta_u": fold(truth["theta_u"])})
    with pytest.warns(RecordingWarning, match="wraps [45] times at a full turn"):
        recording = read_recording(path)
    np.testing.assert_allclose(np.diff(recording.theta_u), np.diff(truth["theta_u"]), atol=1e-9)


def test_counter_overflow_is_unwrapped(tmp_path):
    truth = clean()
    counts = np.round(truth["theta_u"] / STEP).astype(int)
    path = write(tmp_path, {**truth, "theta_u": counts % 4096})
    with pytest.warns(RecordingWarning, match=r"counter range of 2\^12"):
        recording = read_recording(path, parse_map(["theta_u=theta_u:counts/8192"]))
    np.testing.assert_allclose(recording.theta_u, counts * STEP, atol=1e-9)


def test_clean_signals_raise_no_alarm(tmp_path):
    """Peaks, steps between levels and a disc that sticks are no clipping."""
    truth = clean()
    t = truth["t"]
    stick = np.cumsum(np.maximum(0.0, np.sin(1.5 * t)) ** 2) * 0.02
    for u in (3 * np.sin(0.4 * t), np.sign(np.sin(t)), np.minimum(t, 5.0), np.floor(t * 3) % 7):
        theta_l = np.round(stick / STEP) * STEP
        read_quietly(write(tmp_path, {**truth, "u": u, "theta_l": theta_l}))


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.csv", b"", "the file is empty"),
        ("a.csv", b"t,u\n", "no rows|only 0 rows"),
        ("a.csv", b"0,1\n1,2\n", "no header line"),
        ("a.csv", b"t,u,u\n0,1,2\n", "'u' comes twice"),
        ("a.csv", b"t,u\n0,1\n1,2,3\n2,3\n", "does not match the header's 2 columns"),
        ("a.csv", b"t,u,theta_u\n0,1,2\n1,2,3\n2,3", "Expected 3 columns, got 2"),
        ("a.csv", b"\xff\xfe\x00t", "not a text file"),
        (
            "a.csv.gz",
            gzip.compress(b"t,u\n" + bytes(range(48, 58)) * 90, mtime=0)[:-20],
            "truncated",
        ),
        ("a.parquet", b"PAR1 nothing", "not a whole Parquet file"),
        ("a.mat", b"nothing at all", "not a whole MATLAB file"),
        ("a.xlsx", b"PK", "unknown kind of file"),
    ],
)
def test_damaged_files_give_one_clear_error(tmp_path, name, content, message):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError, match=message):
        read_recording(path)


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("u", "write CHANNEL=COLUMN"),
        ("v=u", "unknown channel"),
        ("u=voltage", "no column voltage; found: t, u, theta_u, theta_l"),
        ("t=t:hours", "unknown unit 'hours'; known: s, ms, us"),
        ("theta_u=theta_u:counts/0", "unknown unit"),
    ],
)
def test_bad_maps_give_one_clear_error(tmp_path, entry, message):
    path = write(tmp_path, clean())
    with pytest.raises(InputError, match=message):
        read_recording(path, parse_map([entry]))


@pytest.mark.parametrize(("entry", "volts"), [("u=0", 0.0), ("u=500:mV", 0.5), ("u=-.5:24", -12.0)])
def test_a_number_stands_for_a_drive_that_was_not_recorded(tmp_path, entry, volts):
    """A free decay, or a supply held at one voltage; said so, so no remark on it."""
    truth = clean()
    del truth["u"]
    recording = read_quietly(write(tmp_path, truth), entry, need=("u",))
    np.testing.assert_array_equal(recording.u, np.full(2000, volts))
    np.testing.assert_array_equal(recording.theta_l, truth["theta_l"])
    torque = read_quietly(tmp_path / "run.csv", "torque=0")
    assert torque.drive == "torque" and not torque.u.any()


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("theta_u=0", "no column 0; found"),
        ("t=1", "no column 1; found"),
        ("u=nan", "no column nan"),
        ("u=1e300", "u=1e300 is beyond 100000 V; give less"),
        ("u=1e300:1e300", "beyond 100000 V"),
        ("u=0:furlongs", "unknown unit 'furlongs'"),
    ],
)
def test_a_number_stands_for_nothing_else(tmp_path, entry, message):
    path = write(tmp_path, clean())
    with pytest.raises(InputError, match=message):
        read_recording(path, parse_map([entry]))


def test_a_duty_cycle_is_a_voltage_by_its_supply(tmp_path):
    truth = clean()
    path = write(tmp_path, {**truth, "duty": truth["u"] / 24.0})
    np.testing.assert_allclose(read_quietly(path, "u=duty:24").u, truth["u"], atol=1e-12)


@needs_shared
def test_practice_sets_read_without_false_alarms():
    paths = sorted((SHARED / "practice").glob("*/*.csv.gz"))
    assert paths
    for path in paths:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            recording = read_recording(path)
        assert {note.code for note in recording.notes} <= {"constant"}
        assert list(recording.quanta.values()) == pytest.approx([STEP, STEP], rel=1e-6)
