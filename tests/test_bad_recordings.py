"""No bad recording passes silently, each is called by its name, and no clean one is accused.

Rates over many rigs are in the documentation, measured by `bad_recordings.py`.
"""

from __future__ import annotations

import gzip
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from bad_recordings import BOTH, PHYSICAL, closed_loop, disc_alone, noisy, recording_of, simulated

from drill_env import InputError, Rig
from drill_env.identification.screening import FATAL, findings, screen
from drill_env.recordings import SIGNAL_KINDS, limits, read_recording

SHARED = Path(__file__).resolve().parents[2] / "shared" / "recordings"
needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="no recordings beside the checkout")


@pytest.fixture(scope="module")
def clean():
    """A quasi-random run of the paper's rig and one of another rig."""
    paper = simulated(11, "quasi-random", rate=200.0, seconds=30.0, rig=Rig.paper())
    return paper, simulated(12, "steps", rate=100.0, seconds=30.0)


def outcome(path):
    """The error, or the codes of all remarks, of reading and screening a file."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            recording = read_recording(path, need=("u", "theta_u"))
            return "", [note.code for note in (*recording.notes, *screen(recording))]
        except InputError as error:
            return str(error), []


def _cell(name, row, value):
    def spoil(c):
        column = c[name].astype(object)
        column[row] = value
        return c | {name: column}

    return spoil


def _each(function):
    return lambda c: {name: function(values) for name, values in c.items()}


TABLES = {
    "time backwards": (lambda c: c | {"t": c["t"][::-1]}, "runs backwards in row 3"),
    "rows out of order": (_each(lambda v: v[np.r_[0:50, 60, 50:60, 61:900]]), "runs backwards"),
    "rows doubled": (_each(lambda v: v[np.r_[0:50, 49:900]]), "repeats in row"),
    "two glued": (_each(lambda v: np.append(v[:900], v[:900])), "runs backwards in row 902"),
    "clock in ms": (lambda c: c | {"t": 1e3 * c["t"]}, "probably in ms: --map t=t:ms"),
    "clock in us": (lambda c: c | {"t": 1e6 * c["t"]}, "probably in us: --map t=t:us"),
    "NaN run": (_cell("theta_l", slice(300, 340), np.nan), "40 missing, NaN or infinite"),
    "infinity": (_cell("u", 30, np.inf), "column u has 1 missing"),
    "text": (_cell("u", 30, "fault"), "not numeric: 'fault' in row 32"),
    "decimal commas": (_cell("u", slice(0, 900), "1,5"), "write decimals with a point"),
    "huge value": (_cell("theta_u", 30, 1e30), "theta_u holds 1e\\+30 in row 32"),
    "missing voltage": (lambda c: {k: c[k] for k in ("t", "theta_u", "theta_l")}, "no column u"),
    "missing encoder": (lambda c: {k: c[k] for k in ("t", "u")}, "no column theta_u; found: t, u"),
    "missing time": (lambda c: {k: c[k] for k in ("u", *BOTH)}, "no column t; found: u,"),
    "counts": (
        lambda c: c | {"theta_u": np.round(c["theta_u"] * 8192 / 6.283185307).astype(int)},
        "look like encoder counts",
    ),
    "time for voltage": (lambda c: c | {"u": c["t"], "t": c["u"]}, "column t runs backwards"),
}


@pytest.mark.parametrize("kind", TABLES)
def test_bad_tables_give_one_clear_error(tmp_path, clean, kind):
    spoil, message = TABLES[kind]
    path = tmp_path / "run.csv"
    pd.DataFrame(spoil(clean[0][0])).to_csv(path, index=False)
    error, _ = outcome(path)
    assert error.startswith(f"{path}: ") and "\n" not in error
    pytest.raises(InputError, read_recording, path, need=("u", "theta_u")).match(message)


REMARKED = {
    "rows lost": (_each(lambda v: np.delete(v, np.s_[700:900])), "gap"),
    "wrapped": (lambda c: c | {"theta_u": c["theta_u"] % (2 * np.pi)}, "wrapped"),
    "clipped voltage": (lambda c: c | {"u": np.clip(c["u"], -2, 2)}, "saturated"),
    "constant voltage": (lambda c: c | {"u": 0 * c["u"]}, "constant"),
    "dead encoder": (lambda c: c | {"theta_l": 0 * c["theta_l"]}, "constant"),
    "millivolts": (lambda c: c | {"u": 1e3 * c["u"]}, "large_voltage"),
    "slow clock": (_each(lambda v: v[::20]), "slow_clock"),
}


@pytest.mark.parametrize("kind", REMARKED)
def test_doubtful_tables_give_a_named_warning(tmp_path, clean, kind):
    spoil, code = REMARKED[kind]
    path = tmp_path / "run.csv"
    pd.DataFrame(spoil(clean[0][0])).to_csv(path, index=False)
    error, codes = outcome(path)
    assert not error and codes[0] == code


def _text(c, rows=200):
    return pd.DataFrame({name: values[:rows] for name, values in c.items()}).to_csv(index=False)


FILES = {
    "empty": (lambda c: b"", "the file is empty"),
    "header only": (lambda c: b"t,u,theta_u,theta_l\n", "a header but no rows"),
    "no header": (lambda c: _text(c).split("\n", 1)[1].encode(), "no header line"),
    "last line cut": (lambda c: _text(c).encode()[:-40], "truncated|cut short"),
    "binary": (lambda c: bytes(range(256)) * 20, "not a text file"),
}


@pytest.mark.parametrize("kind", FILES)
def test_damaged_files_give_one_clear_error(tmp_path, clean, kind):
    content, message = FILES[kind]
    path = tmp_path / "run.csv"
    path.write_bytes(content(clean[0][0]))
    pytest.raises(InputError, read_recording, path).match(message)


def test_a_truncated_or_a_giant_archive_gives_one_clear_error(tmp_path, clean, monkeypatch):
    path = tmp_path / "run.csv.gz"
    packed = gzip.compress(_text(clean[0][0], 2000).encode())
    path.write_bytes(packed[: len(packed) // 2])
    pytest.raises(InputError, read_recording, path).match("truncated or damaged; copy it again")
    path.write_bytes(packed)
    # It is the unpacked size that counts.
    monkeypatch.setattr(limits, "MOST_BYTES", 2 * len(packed))
    pytest.raises(InputError, read_recording, path).match("too large for a recording")


@pytest.mark.parametrize("kind", PHYSICAL)
def test_what_no_rig_can_do_is_called_by_its_name(clean, kind):
    bad = PHYSICAL[kind]
    for c, rig in clean:
        recording = recording_of(bad.spoil(c, rig, np.random.default_rng(5)))
        notes = findings(recording)
        assert {note.code for note in notes} == {bad.code}
        assert bad.says in str(notes[0]) and str(notes[0]).startswith("recording: ")
        if bad.code in FATAL:
            with pytest.raises(InputError) as caught:
                screen(recording)
            assert str(caught.value) == str(notes[0])
        else:
            assert [str(note) for note in screen(recording)] == [str(note) for note in notes]


def test_sizes_are_errors_only_against_a_given_rig(clean):
    (c, rig), _ = clean
    recording = recording_of(c | {"u": 1e3 * c["u"]})
    assert [note.code for note in screen(recording)] == ["unit"]
    pytest.raises(InputError, screen, recording, rig).match("the given rig; .*in mV")
    assert screen(recording_of(c), rig) == ()


def test_physics_that_may_be_missing_is_no_wrong_unit(clean):
    """A blind maker's two flexible drives ran 0.54 times as fast as their rig files say."""
    (c, rig), _ = clean
    for times, code in ((2.2, "unit"), (4.0, None)):
        recording = recording_of(c | {"u": times * c["u"]})
        pytest.raises(InputError, screen, recording, rig).match("the given rig")
        if code is None:
            pytest.raises(InputError, screen, recording, rig, incomplete=True).match(
                "the given rig"
            )
        else:
            notes = screen(recording, rig, incomplete=True)
            assert [note.code for note in notes] == [code]


@pytest.mark.parametrize("kind", SIGNAL_KINDS)
def test_clean_recordings_raise_no_alarm(kind):
    for seed in range(3):
        c, rig = simulated(1000 + seed, kind, seconds=25.0)
        assert findings(recording_of(c)) == findings(recording_of(c), rig) == ()
        alone = {name: c[name] for name in ("t", "u", "theta_u")}
        assert findings(recording_of(alone)) == ()
        disc = recording_of(disc_alone(seed))
        assert findings(disc, alone=True) == findings(disc) == ()
        lower = {name: c[name] for name in ("t", "u", "theta_l")}
        assert findings(recording_of(lower)) == ()


def test_noise_gaps_and_coarse_encoders_raise_no_alarm():
    for seed in range(8):
        assert findings(recording_of(noisy(500 + seed))) == ()


def test_a_controller_in_the_loop_raises_no_alarm():
    c = closed_loop(1)
    assert findings(recording_of(c)) == ()
    flipped = recording_of(c | {"theta_l": -c["theta_l"]})
    assert [note.code for note in findings(flipped)] == ["sign"]


def test_missing_samples_are_passed_over(clean):
    (c, _), _ = clean
    theta_l = c["theta_l"].copy()
    theta_l[1000:1400] = np.nan
    flipped = recording_of(c | {"theta_l": theta_l, "u": -c["u"]})
    assert findings(recording_of(c | {"theta_l": theta_l})) == ()
    assert [note.code for note in findings(flipped)] == ["sign"]


@needs_shared
def test_practice_sets_hold_real_effects_and_raise_no_alarm():
    paths = sorted((SHARED / "practice").glob("*/*.csv.gz"))
    assert len(paths) == 30
    for path in paths[::3]:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            assert findings(read_recording(path)) == (), path
