"""Each way in which an outside trial brought the package down, kept as a test."""

from __future__ import annotations

import gzip
import io
import os
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.io import savemat

import drill_env
from drill_env import InputError, Rig
from drill_env._errors import printable
from drill_env.environment.config import EnvConfig
from drill_env.environment.env import DrillStringEnv
from drill_env.identification.coordinates import Coordinates, inverse, solved
from drill_env.parameters import dump_rig, load_rig
from drill_env.recordings import (
    Signal,
    apart,
    limits,
    parse_map,
    parse_signal,
    read_folder,
    read_recording,
    signal_samples,
)

ROOT = Path(drill_env.__file__).parents[1]


def clean(rows=600):
    t = np.arange(rows) / 100.0
    theta = np.round(3.0 * t + 0.1 * np.sin(9.0 * t), 6)
    u = np.round(2.0 + np.sin(5.0 * t), 4)
    return pd.DataFrame({"t": t, "u": u, "theta_u": theta, "theta_l": np.round(0.9 * theta, 6)})


def saved(folder, table, name="run.csv"):
    table.to_csv(folder / name, index=False)
    return folder / name


def run(*args, cwd, out=subprocess.PIPE):
    return subprocess.run(
        [sys.executable, "-m", "drill_env.cli.main", *map(os.fsencode, map(str, args))],
        cwd=cwd, stdout=out, stderr=subprocess.PIPE, text=True, timeout=300, check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip


def refused(done, text):
    assert done.returncode == 2 and text in done.stderr, done.stderr
    assert "Traceback" not in done.stderr and done.stderr.splitlines()[-1].startswith("error: ")


# -- files that crash, or unpack to what no memory holds ------------------------------


@pytest.mark.parametrize(("place", "byte"), [(145, 15), (176, 255), (177, 255), (623, 15)])
def test_a_damaged_matlab_file_is_one_error(place, byte, tmp_path):
    """One byte changed; scipy's reader ends by signals 11, 11 and 7, and does not end at all."""
    out = io.BytesIO()
    savemat(out, {"t": np.arange(50) / 100.0, "c": np.array([1, "a"], dtype=object)})
    content = bytearray(out.getvalue())
    content[place] = byte
    (tmp_path / "run.mat").write_bytes(content)
    begin = time.monotonic()
    with pytest.raises(InputError, match="not a whole MATLAB file|too large"):
        read_recording(tmp_path / "run.mat")
    assert time.monotonic() - begin < 20.0


def test_a_reader_that_crashes_is_one_error(tmp_path, monkeypatch):
    """The reading process is ended by a signal, as by a fault in compiled code."""
    program = tmp_path / "crash.py"
    program.write_text("import os, signal\nos.kill(os.getpid(), signal.SIGSEGV)\n")
    monkeypatch.setattr(apart, "_PROGRAM", program)
    path = tmp_path / "run.mat"
    savemat(path, {name: clean()[name].to_numpy() for name in clean()})
    pytest.raises(InputError, read_recording, path).match("not a whole MATLAB file; copy it again")


def test_a_reader_that_never_ends_is_one_error(tmp_path, monkeypatch):
    program = tmp_path / "hang.py"
    program.write_text("import time\ntime.sleep(60)\n")
    monkeypatch.setattr(apart, "_PROGRAM", program)
    monkeypatch.setattr(limits, "LONGEST_READING", 0.5)
    path = tmp_path / "run.parquet"
    clean().to_parquet(path)
    pytest.raises(InputError, read_recording, path).match("takes far longer")


def test_binary_files_are_read_as_before(tmp_path):
    table = clean()
    table.assign(gain=0.5, word="a").to_parquet(tmp_path / "run.parquet")
    columns = {name: table[name].to_numpy() for name in table}
    savemat(tmp_path / "run.mat", {**columns, "gain": 0.5, "other": np.arange(7.0), "word": "abc"})
    for name in ("run.parquet", "run.mat"):
        recording = read_recording(tmp_path / name)
        np.testing.assert_array_equal(recording.theta_l, table.theta_l)
        assert recording.constant("gain") == 0.5
        assert [note.code for note in recording.notes] == ["ignored_column"]


def _bomb_parquet(path):
    zeros = pa.array(np.zeros(6_000_000))
    pq.write_table(pa.table({f"c{i}": zeros for i in range(7)}), path, compression="zstd")


def _bomb_words(path):
    """Under a kilobyte, the dictionary holds the text once; unpacked it is 60 MB."""
    pq.write_table(pa.table({"t": ["x" * 200_000] * 300}), path, compression="zstd")


def _bomb_columns(path):
    pq.write_table(pa.table({f"c{i}": [1.0] for i in range(1001)}), path)


def _bomb_mat(path):
    savemat(path, {"t": np.zeros((1, 10_000_001), dtype=np.int8)}, do_compression=True)


def _bomb_gzip(path):
    with gzip.open(path, "wb", compresslevel=1) as stream:
        stream.write(b"t,u,theta_u\n")
        for _ in range(7):
            stream.write(b"1,1,1\n" * 1_600_000)


BOMBS = {
    "values.parquet": _bomb_parquet, "words.parquet": _bomb_words, "wide.parquet": _bomb_columns,
    "rows.mat": _bomb_mat, "rows.csv.gz": _bomb_gzip,
}  # fmt: skip


@pytest.mark.parametrize("name", BOMBS)
def test_what_unpacks_beyond_the_limits_is_refused(name, tmp_path, monkeypatch):
    if name == "words.parquet":
        # A tenth of the limit, since a test has no use for half a gigabyte of text.
        monkeypatch.setitem(apart._LIMITS, "bytes", limits.MOST_BYTES // 10)
    path = tmp_path / name
    BOMBS[name](path)
    assert path.stat().st_size < 10_000_000
    pytest.raises(InputError, read_recording, path).match("too large")


def test_millions_of_columns_are_refused_at_once(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text(",".join(f"c{i}" for i in range(1_000_000)) + "\n1\n")
    begin = time.monotonic()
    pytest.raises(InputError, read_recording, path).match("the first line has more than")
    path.write_text(",".join(f"c{i}" for i in range(1001)) + "\n1\n")
    pytest.raises(InputError, read_recording, path).match("1001 columns; too large")
    assert time.monotonic() - begin < 5.0


CELLS = {
    "theta_u": (1e14, "column theta_u holds 1e\\+14 in row 302, beyond 1e\\+09 rad"),
    "u": (1e14, "column u holds 1e\\+14 in row 302, beyond 100000 V"),
    "theta_l": (2e6, "theta_l goes from .* in row 302\\), further than 1e\\+06"),
}


@pytest.mark.parametrize("name", CELLS)
def test_one_absurd_cell_is_refused(name, tmp_path):
    value, message = CELLS[name]
    table = clean()
    table.loc[300, name] = value
    pytest.raises(InputError, read_recording, saved(tmp_path, table)).match(message)


TIMES = {
    "a gap of 30 years": (lambda t: t + 1e9 * (t > 3.0), "covers 1e\\+09 s in steps of 0.01 s"),
    "no time at all": (lambda t: 1e-300 * t, "steps by 1e-302 s, which is shorter"),
    "nanoseconds": (lambda t: 1e-5 * t, "steps by 1e-07 s, which is shorter"),
}


@pytest.mark.parametrize("name", TIMES)
def test_an_absurd_clock_is_refused(name, tmp_path):
    change, message = TIMES[name]
    path = saved(tmp_path, clean().assign(t=change(clean().t)))
    pytest.raises(InputError, read_recording, path).match(message)


def test_a_unit_cannot_make_what_a_cell_may_not_be(tmp_path):
    path = saved(tmp_path, clean())
    pytest.raises(InputError, read_recording, path, parse_map(["u=u:1e300"])).match("beyond 100000")
    pytest.raises(InputError, read_recording, path, parse_map(["t=t:1e-300"])).match("shorter")


def test_far_motions_are_binned_within_the_memory():
    """The grids of the searches by angle and by time have a greatest size, whatever the motion."""
    from drill_env.diagnosis.grids import MOST_PLACES

    widest = 2.0 ** np.ceil(np.log2(MOST_PLACES + 8.0))
    assert 8 * widest < 2**30 and MOST_PLACES / limits.LARGEST_SPAN > 26 / (2 * np.pi)


# -- text and names ------------------------------------------------------------------


def test_lines_that_end_by_a_carriage_return_are_read(tmp_path):
    path = saved(tmp_path, clean())
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r"))
    np.testing.assert_array_equal(read_recording(path).u, clean().u)


def test_a_giant_header_is_one_error(tmp_path):
    path = tmp_path / "run.csv"
    for header in ("t,u," + "x" * 300_000, 't,"u' + "x" * 300_000):
        path.write_text(header + "\n1,2,3\n")
        pytest.raises(InputError, read_recording, path).match("the first line has more than")


def test_names_that_are_no_utf8_are_one_error(tmp_path):
    path = tmp_path / "run.parquet"
    clean().to_parquet(path)
    path.write_bytes(path.read_bytes().replace(b"theta_l", b"theta\xff\xfe"))
    pytest.raises(InputError, read_recording, path).match("not a whole Parquet file")


def test_a_file_whose_name_is_no_utf8_is_read_and_shown(tmp_path):
    path = os.fsencode(tmp_path) + b"/run\xff\x1b[31m.csv"
    saved(tmp_path, clean()).rename(os.fsdecode(path))
    recording = read_recording(os.fsdecode(path))
    assert recording.source.endswith("run\\udcff\\x1b[31m.csv") and recording.source.isprintable()
    recording.source.encode("utf-8")


def test_an_output_whose_name_is_no_utf8_is_told(tmp_path):
    name = os.fsdecode(b"out\xff.csv")
    done = run("signal", "steps", "--seconds", 2, "--out", name, "--json", cwd=tmp_path)
    assert done.returncode == 0 and "Traceback" not in done.stderr, done.stderr
    assert (tmp_path / name).is_file()


def test_messages_are_one_short_printable_line():
    text = str(InputError("a\nb\r\x1b[2J\udcff\u202e" + "x" * 10_000))
    assert text.startswith("a b \\x1b[2J\\udcff\\u202exxx") and len(text) == 2001
    assert printable("θ_u ± 1 °") == "θ_u ± 1 °"


PATTERNS = {
    "a**.csv": "is no name or pattern|no file", "../run.csv": "outside the folder",
    "\\u0000": "is no name or pattern|no file", "[": "no file",
}  # fmt: skip


@pytest.mark.parametrize("pattern", PATTERNS)
def test_a_pattern_that_names_nothing_is_one_error(pattern, tmp_path):
    inside = tmp_path / "set"
    inside.mkdir()
    saved(tmp_path, clean())
    (inside / "recordings.toml").write_text(f'[[recording]]\nfile = "{pattern}"\n')
    pytest.raises(InputError, read_folder, inside).match(PATTERNS[pattern])


# -- rig files, effects, options ---------------------------------------------------------

HUGE = "1" + "0" * 400
RIGS = {
    "an integer beyond floats": ("km = 3.5693", f"km = {HUGE}", "rig.km is a number of more than"),
    "digits without end": ("km = 3.5693", f"km = {HUGE * 20}", "is not TOML"),
    "nesting without end": ("km = 3.5693", f"km = {'[' * 5000}", "nested too deeply|is not TOML"),
    "a list": ("km = 3.5693", "km = [1]", "km is .* give a number"),
    "an infinity": ("km = 3.5693", "km = inf", "km is inf: give a finite number"),
}


@pytest.mark.parametrize("name", RIGS)
def test_a_bad_number_in_a_rig_file_is_one_error(name, tmp_path):
    old, new, message = RIGS[name]
    path = tmp_path / "rig.toml"
    path.write_text(dump_rig(Rig()).replace(old, new))
    pytest.raises(InputError, load_rig, path).match(message)


@pytest.mark.parametrize("torque", ['"a"', "[1.0]", "true", "{ a = 1 }", "nan", HUGE])
def test_a_bad_effect_is_one_line_of_the_command(torque, tmp_path):
    path = tmp_path / "rig.toml"
    entry = f'\n[[effects]]\nid = "unbalance"\ntorque = {torque}\nphase = 0.0\n'
    path.write_text(dump_rig(Rig()) + entry)
    from drill_env.cli._common import rig_from

    pytest.raises(InputError, rig_from, path).match("rig.toml: .*torque is")


OPTIONS = [
    ({"schedule": [(-1.0, 2.0)]}, "time is -1.0"), ({"schedule": [(np.nan, 2.0)]}, "finite"),
    ({"schedule": 3}, "schedule is 3"), ({"friction_step": ((0, 1), (1, np.inf))}, "finite"),
    ({"friction_step": ((0, 1), (1, 1e300))}, "friction_step is"),
    ({"friction_step": "abcd"}, "friction_step is"), ({"setpoint": 10**400}, "setpoint is inf"),
    ({"setpoint": "3"}, "give a number"),
]  # fmt: skip
MADE = [
    ({"encoder": {"rate_hz": "a"}}, "rate_hz is 'a'"), ({"encoder": {"x": 1}}, "unknown key x"),
    ({"encoder": 3}, "encoder is 3"), ({"reward": {"track": None}}, "track is None"),
    ({"rig": {"km": [1]}}, "km is"), ({"uncertainty": 5}, "uncertainty is 5"),
    ({"history": "a"}, "history is 'a'"), ({"setpoint_range": 5}, "setpoint_range is 5"),
    ({"encoder": {"rate_hz": 1e12}}, "rate_hz is"), ({"encoder": {"delay_s": 1e9}}, "delay_s is"),
    ({"rig": {"effects": None}}, "effects is None"), ({"rig": {"effects": "a"}}, "effects is 'a'"),
    ({3: 4}, "unknown option 3"), ({"episode_seconds": np.inf}, "finite"),
]  # fmt: skip


@pytest.mark.parametrize(("options", "message"), [*OPTIONS, *MADE])
def test_bad_options_of_an_environment_are_one_error(options, message):
    pytest.raises(InputError, EnvConfig.from_options, options).match(message)


@pytest.fixture(scope="module")
def env():
    return DrillStringEnv(schedule=((1.0, 2.0),))


STATES = [
    ({"state": (1e300, 0.0, 0.0)}, "twist is 1e\\+300, beyond"), ({"state": "abc"}, "give 3"),
    ({"state": (0.0, 1e4, 0.0)}, "omega_u is 10000, beyond"), ({"state": (0, [1], 0)}, "number"),
    ({"delay_s": "a"}, "delay_s is 'a'"), ({"start": ["rest"]}, "start is"),
]  # fmt: skip


@pytest.mark.parametrize(("options", "message"), [*OPTIONS, *STATES])
def test_bad_options_of_a_reset_are_one_error(env, options, message):
    with pytest.raises(InputError, match=message):
        env.reset(seed=1, options=options)


# -- a diagnosis --------------------------------------------------------------------------


def test_a_start_at_zero_of_what_is_a_logarithm_names_the_remedy():
    rig = Rig(Tsl=0.0)
    with pytest.raises(InputError, match="Tsl is 0.0 .* hold it: --fix Tsl=0"):
        Coordinates(rig, ("km", "Tsl")).vector(rig)
    assert np.isfinite(Coordinates(rig, ("km", "bl")).vector(rig)).all()


def test_what_the_recordings_do_not_tell_moves_nothing():
    singular = np.array([[2.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 4.0]])
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.solve(singular, np.ones(3))
    np.testing.assert_allclose(solved(singular, np.ones(3)), [0.5, 0.0, 0.25])
    regular = np.array([[2.0, 0.5], [0.5, 1.0]])
    np.testing.assert_allclose(solved(regular, np.eye(2)), inverse(regular), rtol=1e-12)
    assert np.isnan(solved(np.full((2, 2), np.nan), np.ones(2))).all()


def test_rounding_makes_no_variance_negative():
    """An information's smallest eigenvalue is rounding where nothing is known, of either sign."""
    axes = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    information = axes @ np.diag([2.0, 1.0, -3e-14]) @ axes.T
    information = 0.5 * (information + information.T)
    found = inverse(information)
    assert np.diag(found).min() > 0.0 and np.linalg.eigvalsh(found).min() > -1e-12
    np.testing.assert_allclose(information @ found @ information, information, atol=1e-12)


# -- output -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("steps --rate 1e308", "are inf samples; give 2 to"),
        ("steps --dwell 1e-300", "longer --dwell or fewer --seconds"),
        ("quasi-random --rate 1e-9 --seconds 1e15", "longer --dwell or fewer --seconds"),
    ],
)
def test_a_signal_without_end_is_one_error(text, message):
    with pytest.raises(InputError, match=message):
        parse_signal(text)


def test_a_level_held_longer_than_the_signal_is_one_level():
    _, u = signal_samples(parse_signal("steps --dwell 1.7e308"))
    assert np.ptp(u) == 0.0 and np.isfinite(u).all()


def test_a_seed_of_any_length_and_numbers_beyond_floats():
    """A seed is a whole number and need not fit a float; every other number must."""
    _, u = signal_samples(parse_signal(f"steps --seed {HUGE}"))
    assert np.isfinite(u).all() and np.ptp(u) > 0.0
    with pytest.raises(InputError, match="--seconds is inf: give a finite number"):
        Signal("steps", seconds=int(HUGE))
    with pytest.raises(InputError, match="--seed is 1.5: give a whole number"):
        Signal("steps", seed=1.5)  # pyright: ignore[reportArgumentType]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_disk_is_one_line(tmp_path):
    with open("/dev/full", "w") as full:
        refused(run("rig", "show", cwd=tmp_path, out=full), "No space left on device; make room")


def test_a_full_disk_leaves_nothing_behind(tmp_path, monkeypatch):
    from drill_env import _files

    kept = tmp_path / "a.txt"
    kept.write_text("old")
    write = Path.write_text

    def full(self, text, **options):
        if text == "second":
            write(self, text[:3], **options)
            raise OSError(28, "No space left on device")
        return write(self, text, **options)

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(InputError, match="cannot write .*b.txt: No space left on device"):
        _files.write_texts({kept: "first", tmp_path / "b.txt": "second"})
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"] and kept.read_text() == "old"


# -- pages and checkpoints -----------------------------------------------------------------

NAME = "</script><script>alert(1)</script><img src=x>$a^$"


def test_a_controllers_name_is_text_in_the_page():
    import plotly.graph_objects as go

    from drill_env.report.bifurcation_page import html_table, page

    figure = go.Figure(go.Scatter(x=[1], y=[1], name=NAME))
    text = page(figure, [{"title": NAME}], html_table(("a",), [(NAME,)]), NAME)
    assert NAME not in text and "<img src=x>" not in text
    assert "&lt;img src=x&gt;" in text


def test_names_are_drawn_letter_by_letter():
    from matplotlib.figure import Figure

    from drill_env.report.names import drawn

    figure = Figure()
    figure.suptitle(drawn("a $x^$ b"))
    figure.savefig(io.BytesIO())


class Runs:
    """What a pickle does when it is loaded."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return (open, (str(self.path), "w"))


def test_a_checkpoint_cannot_run_code(tmp_path):
    import base64
    import json
    import pickle

    torch = pytest.importorskip("torch")
    from drill_env.agents.checkpoint import read_checkpoint

    state = io.BytesIO()
    torch.save({"weight": torch.ones(2)}, state)
    evil = io.BytesIO()
    torch.save({"weight": Runs(tmp_path / "ran")}, evil)
    pickled = base64.b64encode(pickle.dumps(Runs(tmp_path / "ran"))).decode()
    data = {"num_timesteps": 7, "policy_class": {":type:": "x", ":serialized:": pickled}}
    path = tmp_path / "checkpoint.zip"
    for content in (state.getvalue(), evil.getvalue()):
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("data", json.dumps(data))
            archive.writestr("policy.pth", content)
        if content == state.getvalue():
            steps, parameters = read_checkpoint(path)
            assert steps == 7 and torch.equal(parameters["policy"]["weight"], torch.ones(2))
        else:
            pytest.raises(InputError, read_checkpoint, path).match("damaged or no checkpoint")
    assert not (tmp_path / "ran").exists()


def test_a_policy_with_a_damaged_header_is_one_error(tmp_path):
    """Found by the fuzz: numpy's reader of headers raises an error of Python's tokenizer."""
    import hashlib
    import json

    from drill_env.agents import find, load

    with np.load(find("encoders-ppo") / "policy.npz") as arrays:
        np.savez(tmp_path / "policy.npz", **{name: arrays[name] for name in arrays.files})
    path = tmp_path / "policy.npz"
    setting = json.loads((find("encoders-ppo") / "agent.json").read_text())
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    parts["weight0.npy"] = parts["weight0.npy"].replace(b"'shape': (", b"'shape':((", 1)
    with zipfile.ZipFile(path, "w") as archive:
        for name, part in parts.items():
            archive.writestr(name, part)
    setting["policy_sha256"] = hashlib.sha256(path.read_bytes()).hexdigest()
    (tmp_path / "agent.json").write_text(json.dumps(setting))
    pytest.raises(InputError, load, tmp_path).match("policy.npz is damaged")
