"""One file a channel, clocks that differ, and delays: against brute force on a fine grid."""

from __future__ import annotations

import warnings

import numpy as np
import pandas as pd
import pytest

from drill_env import InputError
from drill_env.recordings import RecordingWarning, parse_map, read_folder, read_recording
from drill_env.recordings.clocks import held

RATE = 200.0
T = np.arange(2000) / RATE


def drive(t):
    return 2.0 + np.sin(2.0 * t)


def top(t):
    return 3.0 * t + 0.5 * np.sin(4.0 * t)


def bit(t):
    return 3.0 * t + 0.4 * np.sin(4.0 * t - 0.3)


def write(folder, **files):
    for name, columns in files.items():
        pd.DataFrame(columns).to_csv(folder / f"{name}.csv", index=False)


def read(folder, entry, defaults=""):
    text = f"[defaults]\n{defaults}\n[[recording]]\n{entry}\n"
    (folder / "recordings.toml").write_text(text)
    return read_folder(folder).fit[0]


def quietly(folder, entry, defaults=""):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return read(folder, entry, defaults)


FOUR = 'files = { t = "time.csv", u = "volt.csv", theta_u = "top.csv", theta_l = "bit.csv" }'


def test_one_signal_a_file_by_the_rows_of_the_time(tmp_path):
    """Headers are free where a file has one column."""
    write(
        tmp_path, time={"Time": 1e3 * T}, volt={"value": drive(T)}, top={"value": top(T)},
        bit={"theta_l": np.degrees(bit(T)), "quality": 1.0 + 0.0 * T},
    )  # fmt: skip
    recording = quietly(tmp_path, FOUR, 'units = { t = "ms", theta_l = "deg" }')
    for name, values in (("t", T), ("u", drive(T)), ("theta_u", top(T)), ("theta_l", bit(T))):
        np.testing.assert_allclose(recording.channel(name), values, atol=1e-9)
    assert recording.source.endswith("top.csv")


def test_clocks_that_differ_keep_every_sample_at_its_time(tmp_path):
    """A fast drive, a slow lower encoder: the upper one has most samples and gives the rows."""
    fast = np.arange(-40, 20_100) / 2000.0 + 0.00013
    slow = T[::4]
    write(
        tmp_path, volt={"t": fast, "ch1": drive(fast)}, top={"t": T, "ch1": top(T)},
        bit={"t": slow, "ch1": bit(slow)},
    )  # fmt: skip
    recording = quietly(tmp_path, FOUR.replace('t = "time.csv", ', ""))
    np.testing.assert_array_equal(recording.t, T)
    np.testing.assert_array_equal(recording.theta_u, top(T))
    np.testing.assert_array_equal(recording.theta_l[::4], bit(slow))
    assert np.isnan(recording.theta_l).sum() == len(T) - len(slow)
    middle = drive(T + 0.5 / RATE)
    np.testing.assert_allclose(recording.u, middle, atol=2.0 / 2000.0)


def test_the_drive_on_other_rows_has_the_same_impulse():
    rng = np.random.default_rng(0)
    clock = np.cumsum(rng.uniform(0.9, 1.1, 300)) * 0.003
    u = rng.normal(size=300)
    t = np.arange(0, 200) * 0.005
    found = held(t, clock, u)
    fine = np.arange(0, 1.0, 1e-6) + 0.5e-6
    steps = u[np.clip(np.searchsorted(clock, fine, side="right") - 1, 0, None)]
    truth = steps.reshape(200, -1).mean(axis=1)
    known = np.isfinite(found)
    end = clock[-1] + np.median(np.diff(clock))
    wanted = (t >= clock[0] - 3e-5) & (t + 0.005 <= end + 3e-5)
    assert known.tolist() == wanted.tolist() and known.sum() > 150
    np.testing.assert_allclose(found[known], truth[known], atol=2e-3)


def test_a_gap_of_the_drive_is_one_of_the_recording(tmp_path):
    clock = np.delete(T, np.s_[700:900])
    write(tmp_path, volt={"t": clock, "x": drive(clock)}, top={"t": T + 0.001, "x": top(T + 0.001)})
    with pytest.warns(
        RecordingWarning, match="the drive or a load is not known in 202 rows; left out"
    ):
        recording = read(tmp_path, 'files = { u = "volt.csv", theta_u = "top.csv" }')
    assert len(recording.gaps) == 1 and np.isfinite(recording.u).all()
    assert recording.t[recording.gaps[0]] == pytest.approx(3.5, abs=0.011)


UNLIKE = {
    "volt": {"t": T, "x": drive(T)}, "top": {"t": T, "x": top(T)},
    "bit": {"t": T[:-1] + 0.002, "x": bit(T[:-1] + 0.002)},
}  # fmt: skip


def test_readings_are_interpolated_only_if_that_is_asked_for(tmp_path):
    write(tmp_path, **UNLIKE)
    entry = FOUR.replace('t = "time.csv", ', "")
    with pytest.raises(InputError, match="0 of the 1999 samples of theta_l stand at.*interpolate"):
        read(tmp_path, entry)
    with pytest.warns(RecordingWarning, match="theta_l is interpolated in 1998 of 2000 rows"):
        recording = read(tmp_path, entry + "\ninterpolate = true")
    inside = np.isfinite(recording.theta_l)
    assert inside[1:-1].all() and not inside[0] and not inside[-1]
    # A straight line errs by an eighth of acceleration times interval squared.
    bound = 0.4 * 16.0 / RATE**2 / 8.0
    error = np.abs(recording.theta_l - bit(T))[inside].max()
    assert 0.5 * bound < error <= 1.01 * bound


def test_samples_at_no_rows_time_are_passed_over_and_counted(tmp_path):
    drifting = {"t": T * 1.0001, "x": bit(T * 1.0001)}
    write(tmp_path, **{**UNLIKE, "bit": drifting})
    with pytest.warns(RecordingWarning, match="1898 of 1999 samples of theta_l stand at no"):
        recording = read(tmp_path, FOUR.replace('t = "time.csv", ', ""))
    kept = np.isfinite(recording.theta_l)
    assert kept[:90].all() and kept.sum() < 200
    np.testing.assert_allclose(recording.theta_l[kept], bit(T[kept]), atol=5.0 * 5e-5)


@pytest.mark.parametrize("rows", [5, -5])
def test_a_delay_of_whole_rows_is_exact(rows, tmp_path):
    late = bit(T - rows / RATE)
    table = {"t": T, "u": drive(T), "theta_u": top(T), "theta_l": late, "other": T}
    write(tmp_path, run=table)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        maps = parse_map([f"theta_l=theta_l:rad@{rows / RATE}"])
        mapped = read_recording(tmp_path / "run.csv", maps)
    told = quietly(tmp_path, f'file = "run.csv"\ndelay = {{ theta_l = {rows / RATE} }}')
    for recording in (mapped, told):
        known = np.isfinite(recording.theta_l)
        assert known.sum() == len(T) - 5 and (~known[-5:] if rows > 0 else ~known[:5]).all()
        np.testing.assert_allclose(recording.theta_l[known], bit(T)[known], atol=1e-9)
        np.testing.assert_array_equal(recording.theta_u, top(T))
        np.testing.assert_array_equal(recording.extra["other"], T)


def test_a_delay_of_part_of_a_row_is_refused_or_interpolated(tmp_path):
    late = bit(T - 0.004)
    write(tmp_path, run={"t": T, "u": drive(T), "theta_l": late})
    entry = 'file = "run.csv"\ndelay = { theta_l = 0.004 }'
    with pytest.raises(InputError, match="0 of the 2000 samples of theta_l stand at.*delay"):
        read(tmp_path, entry)
    with pytest.warns(RecordingWarning, match="theta_l is interpolated in 1999"):
        recording = read(tmp_path, entry + "\ninterpolate = true")
    np.testing.assert_allclose(recording.theta_l[:-1], bit(T)[:-1], atol=0.4 * 16 / RATE**2 / 8)


def test_a_delay_of_the_drive_keeps_its_impulse(tmp_path):
    """The recorded voltage acted 2 ms, 0.4 rows, before its row: then the next one holds."""
    write(tmp_path, run={"t": T, "u": drive(T), "theta_u": top(T)})
    with pytest.warns(RecordingWarning, match="the drive or a load is not known in 1 rows"):
        recording = read_recording(tmp_path / "run.csv", parse_map(["u=u@0.002"]))
    u = drive(T)
    np.testing.assert_array_equal(recording.t, T[:-1])
    np.testing.assert_allclose(recording.u, 0.6 * u[:-1] + 0.4 * u[1:], atol=1e-9)
    files = 'files = { u = "v.csv", theta_u = "run.csv" }\ndelay = { u = 0.002 }'
    write(tmp_path, v={"t": T, "u": drive(T)})
    with pytest.warns(RecordingWarning):
        again = read(tmp_path, files)
    np.testing.assert_allclose(again.u, recording.u, atol=1e-12)


def test_names_with_an_at_are_names(tmp_path):
    write(tmp_path, run={"t": T, "u@2": drive(T), "theta_u": top(T)})
    recording = read_recording(tmp_path / "run.csv", parse_map(["u=u@2"]))
    np.testing.assert_array_equal(recording.u, drive(T))
    recording = read_recording(tmp_path / "run.csv", parse_map(["u=u@2:mV"]))
    np.testing.assert_allclose(recording.u, 1e-3 * drive(T))


def test_a_free_decay_of_files_needs_no_file_of_the_drive(tmp_path):
    write(tmp_path, **UNLIKE)
    files = 'files = { theta_u = "top.csv" }'
    with pytest.raises(InputError, match="no file of u; add it to files"):
        read(tmp_path, files)
    assert not quietly(tmp_path, files + "\ncolumns = { u = 0 }").u.any()


BAD = {
    "both": ('file = "top.csv"\nfiles = { theta_u = "top.csv" }', "give either file = "),
    "no table": ("files = 3", "give either file = "),
    "key": ('files = { x = "top.csv" }', "files: unknown key x"),
    "no reading": ('files = { u = "volt.csv" }', "files needs one of a reading"),
    "two drives": (
        'files = { u = "volt.csv", torque = "bit.csv", theta_u = "top.csv" }', "and one drive",
    ),
    "none": ('files = { theta_u = "z.csv" }', "no file .*z.csv; check the name"),
    "outside": ('files = { theta_u = "../z.csv" }', "no file|lies outside"),
    "many": ('files = { theta_u = "*.csv" }', "files.theta_u matches 4; name one"),
    "type": ("files = { theta_u = 3 }", "no file; write file"),
    "rows": (
        'files = { t = "volt.csv", theta_u = "bare.csv" }',
        "bare.csv has 50 rows and volt.csv 2000",
    ),
    "no time": ('files = { theta_u = "bare.csv" }', "bare.csv: no column t of its time; name it"),
    "column": (
        'files = { theta_u = "top.csv" }\ncolumns = { theta_u = "y", u = 0 }',
        "top.csv: no column y; found: t, x",
    ),
    "delay": ('file = "top.csv"\ndelay = 3', "delay is no table; write delay = { theta_l"),
    "delay of t": ('file = "top.csv"\ndelay = { t = 3 }', "delay: unknown key t"),
    "delay word": ('file = "top.csv"\ndelay = { u = "1" }', "delay.u is '1': give a number"),
    "delay nan": ('file = "top.csv"\ndelay = { u = nan }', "delay.u is nan: give a finite number"),
    "long delay": (
        'file = "top.csv"\ncolumns = { theta_u = "x", u = 0 }\ndelay = { theta_u = 1e300 }',
        "the delay of theta_u, 1e\\+300 s, is longer than the recording",
    ),
    "far clock": (
        'files = { u = "volt.csv", theta_u = "top.csv" }\ndelay = { theta_u = 1e300 }',
        "only 0 rows|longer|covers",
    ),
    "flag": ('file = "top.csv"\ninterpolate = 1', "interpolate is 1; give true or false"),
}  # fmt: skip


@pytest.mark.parametrize("kind", BAD)
def test_bad_files_and_delays_are_one_line(kind, tmp_path):
    entry, message = BAD[kind]
    write(tmp_path, **UNLIKE, bare={"x": top(T[:50])})
    with pytest.raises(InputError, match=message):
        read(tmp_path, entry)


@pytest.mark.parametrize("entry", ["t=t@1", "u=0@1"])
def test_no_delay_of_time_or_of_a_number(entry, tmp_path):
    write(tmp_path, run={"t": T, "u": drive(T), "theta_u": top(T)})
    with pytest.raises(InputError, match="no delay here"):
        read_recording(tmp_path / "run.csv", parse_map([entry]))
