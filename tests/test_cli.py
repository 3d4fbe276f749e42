"""The command line as a user meets it: files, streams and exit status."""

from __future__ import annotations

import gzip
import json
import math
import os
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

from drill_env import Rig, load_rig
from drill_env.cli.main import obey
from drill_env.integrator import simulate

COLUMNS = ["t", "u", "theta_u", "theta_l", "omega_u", "omega_l"]
COMMANDS = ["", "demo", "rig", "rig show", "simulate", "replay", "identify", "compare", "fleet"]
QUICK = ["--setpoints", "0.5,4", "--seconds", "20", "--window", "5"]


def drill(*args, cwd):
    """Run the console script's entry point in its own process."""
    environment = {**os.environ, "COLUMNS": "100", "MPLBACKEND": "Agg"}
    return subprocess.run(
        [sys.executable, "-m", "drill_env.cli.main", *map(str, args)],
        cwd=cwd, env=environment, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip


def exact_csv(source):
    """A table with every digit, whatever pandas' default precision."""
    return pd.read_csv(source, dtype=str).astype(float)


@pytest.fixture
def ok(tmp_path):
    def call(*args):
        done = drill(*args, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        return done

    return call


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with one run of 20 s at 3.5 V and the default rig file."""
    folder = tmp_path_factory.mktemp("made")
    assert not drill(
        "simulate", "--volts=3.5", "--seconds=20", "--out=r.csv", cwd=folder
    ).returncode
    (folder / "rig.toml").write_text(drill("rig", "show", cwd=folder).stdout)
    return folder


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(command, ok):
    done = ok(*command.split(), "--help")
    assert "Usage:" in done.stdout and done.stderr == ""


def test_shown_rig_is_the_default_one(made):
    assert load_rig(made / "rig.toml") == Rig.paper()


def test_simulated_table_is_the_exact_trajectory_with_every_digit(made):
    table = exact_csv(made / "r.csv")
    exact = simulate(Rig.paper(), 3.5, 20.0)
    assert list(table.columns) == COLUMNS and len(table) == 4001
    for name in COLUMNS:
        assert np.array_equal(table[name], getattr(exact, name)), name


def test_played_back_voltage_gives_the_same_run(made, ok, tmp_path):
    ok("simulate", "--input", made / "r.csv", "--rig", made / "rig.toml", "--out", "again.csv")
    again = exact_csv(tmp_path / "again.csv")
    first = exact_csv(made / "r.csv")
    assert np.abs(again - first).to_numpy().max() < 1e-9


def test_played_back_steps_keep_every_row_of_a_late_clock(ok, tmp_path):
    t = 0.1 + np.arange(400) * 0.07
    u = np.where(np.arange(400) % 80 < 40, 3.0, 1.0)
    pd.DataFrame({"clock": t, "volts": u}).to_csv(tmp_path / "in.csv", index=False)
    ok(
        "simulate",
        "--input",
        "in.csv",
        "--map",
        "t=clock",
        "--map",
        "u=volts",
        "--out",
        "o.parquet",
    )
    out = pd.read_parquet(tmp_path / "o.parquet")
    assert np.array_equal(out.t, t) and np.array_equal(out.u, u)


def test_encoder_parquet_and_gzip(ok, tmp_path):
    run = ["simulate", "--volts", 2, "--seconds", 5, "--rate", 100]
    ok(*run, "--out", "exact.parquet")
    ok(*run, "--encoder", "--counts", 1000, "--out", "seen.csv.gz")
    exact = pd.read_parquet(tmp_path / "exact.parquet")
    with gzip.open(tmp_path / "seen.csv.gz", "rt") as stream:
        seen = exact_csv(stream)
    quantum = 2.0 * math.pi / 1000
    for name in ("theta_u", "theta_l"):
        assert np.abs(seen[name] - exact[name]).max() <= 0.5 * quantum + 1e-12
        assert np.abs(seen[name] / quantum - np.round(seen[name] / quantum)).max() < 1e-9
    assert np.abs(seen.omega_u - exact.omega_u).max() > 1e-3


def test_voltage_within_stiction_moves_nothing(ok, tmp_path):
    ok("simulate", "--volts", 0.09, "--seconds", 20, "--out", "still.csv")
    assert (pd.read_csv(tmp_path / "still.csv")[COLUMNS[2:]] == 0.0).all(axis=None)


JSON = {
    "rig show": ["rig", "show"],
    "simulate": ["simulate", "--volts", "3.5", "--seconds", "1", "--out", "s.csv"],
    "replay": ["replay", "r.csv"],
    "compare": ["compare", "--controllers", "pi", "--out", "c", "--setpoints", "0.5,9", *QUICK[2:]],
    "agent": ["compare", "--controllers", "pi", "--agent", "surface-ppo", "--out", "c", *QUICK],
}


@pytest.mark.parametrize("name", JSON)
def test_json_is_one_document_alone_on_stdout(name, made):
    done = drill(*JSON[name], "--json", cwd=made)
    assert done.returncode == 0, done.stderr
    assert isinstance(json.loads(done.stdout, parse_constant=pytest.fail), dict)
    # On a fresh machine a line says that it compiles.
    told = ("warning: ", "first call")
    assert all(line.startswith(told) for line in done.stderr.splitlines())


def test_compare_writes_all_files_and_warns_of_what_is_out_of_reach(made):
    done = drill("compare", "--out", "all", "--setpoints", "0.5,9", *QUICK[2:], cwd=made)
    assert done.returncode == 0, done.stderr
    assert sorted(p.name for p in (made / "all").iterdir()) == [
        "compare.csv", "compare.json", "compare.parquet", "compare.png",
    ]  # fmt: skip
    assert "warning: set point 9 rad/s is out of reach" in done.stderr
    assert "active-damping" in done.stdout


def test_demo_runs_the_main_job(ok, tmp_path):
    report = json.loads(ok("demo", "--out", "out", "--json").stdout)
    assert report["simulation"]["omega_l_max"] == pytest.approx(13.0474, abs=1e-3)
    free = {(r["controller"], r["start"]): r["vibration_free"] for r in report["comparison"]}
    assert free["active-damping", "limit_cycle"] == 12 > 1 == free["pi", "rest"]
    (found,) = report["detective"]["effects"]
    assert found["id"] == report["detective"]["hidden"]["id"] == "brake_runout"
    for name, number in found["parameters"].items():
        assert number["low"] < report["detective"]["hidden"][name] < number["high"]
    assert "recording" not in report
    for name in ("simulation.png", "compare/compare.png", "detective/index.html"):
        assert (tmp_path / "out" / name).stat().st_size > 0


SIMULATE = ["simulate", "--out", "x.csv"]
CONSTANT = [*SIMULATE, "--volts", "3", "--seconds", "2"]
COMPARE = ["compare", "--out", "x", *QUICK]
BAD = {
    "no voltage": (SIMULATE, ["--volts", "--input"]),
    "both": ([*CONSTANT, "--input", "good.csv"], ["--volts", "--input", "give one"]),
    "no seconds": ([*SIMULATE, "--volts", "3"], ["--seconds"]),
    "nan volts": ([*SIMULATE, "--volts", "nan", "--seconds", "1"], ["nan", "finite"]),
    "word": ([*CONSTANT, "--rate", "fast"], ["--rate", "simulate --help"]),
    "negative": ([*SIMULATE, "--volts", "3", "--seconds", "-1"], ["seconds", "greater than 0"]),
    "unknown option": ([*CONSTANT, "--speed", "3"], ["--speed", "--help"]),
    "unknown command": (["drill"], ["drill", "--help"]),
    "short initial": ([*CONSTANT, "--initial", "1,2"], ["--initial", "twist,omega_u,omega_l"]),
    "counts": ([*CONSTANT, "--encoder", "--counts", "-1"], ["counts", "give 0 to"]),
    "no input": ([*SIMULATE, "--input", "none.csv"], ["none.csv", "check the path"]),
    "no column": ([*SIMULATE, "--input", "noval.csv"], ["noval.csv", "u", "--map"]),
    "nan cell": ([*SIMULATE, "--input", "nan.csv"], ["nan.csv", "column u", "row 7"]),
    "text cell": ([*SIMULATE, "--input", "text.csv"], ["text.csv", "column u", "row 7"]),
    "bad map": ([*SIMULATE, "--input", "good.csv", "--map", "v=x"], ["v=x"]),
    "no rig": ([*CONSTANT, "--rig", "none.toml"], ["none.toml", "check the path"]),
    "rig key": ([*CONSTANT, "--rig", "key.toml"], ["key.toml", "kthetta", "known: km"]),
    "rig type": (["rig", "show", "--rig", "type.toml"], ["type.toml", "Jl", "give a number"]),
    "no folder": ([*CONSTANT, "--out", "none/x.csv"], ["none/x.csv", "make it first"]),
    "ending": ([*CONSTANT, "--out", "x.xls"], ["x.xls", ".parquet"]),
    "controller": ([*COMPARE, "--controllers", "pid"], ["pid", "known: open-loop, pi"]),
    "no controller": ([*COMPARE, "--controllers", ""], ["--controllers", "--agent"]),
    "no agent": ([*COMPARE, "--agent", "none"], ["none", "train.py", "encoders-ppo"]),
    "bad agent": ([*COMPARE, "--agent", "broken"], ["broken", "agent.json", "train it again"]),
    "agent twice": (
        [*COMPARE, "--agent", "encoders-ppo", "--agent", "encoders-ppo"],
        ["two controllers are called encoders-ppo", "each once"],
    ),
    "set points": ([*COMPARE, "--setpoints", "a"], ["--setpoints", "separated by commas"]),
    "set point": ([*COMPARE, "--setpoints", "70"], ["setpoint is 70", "at most 60"]),
    "window": ([*COMPARE, "--window", "30"], ["window is 30", "at most 20"]),
    "limit": ([*COMPARE, "--voltage-limit", "50"], ["voltage_limit", "15 V"]),
    "folder is a file": ([*COMPARE, "--out", "good.csv"], ["good.csv", "give a folder"]),
    "replay": (["replay", "none.csv"], ["none.csv", "check the path"]),
    "replay rig": (["replay", "good.csv", "--rig", "key.toml"], ["key.toml", "kthetta"]),
    "replay out": (["replay", "good.csv", "--out", "none/x.png"], ["none", "make it first"]),
    "identify": (["identify", "good.csv"], ["scale of torque", "--fix"]),
    "identify file": (["identify", "none.csv", "--one-inertia"], ["none.csv", "check the path"]),
    "demo": (["demo", "--recordings", "none", "--out", "x"], ["none", "check the path"]),
}


@pytest.fixture(scope="module")
def bad_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bad")
    rows = [f"{0.01 * i:.2f},{1 + i % 3},{0.1 * i}" for i in range(30)]
    texts = {"good": rows}
    for name, cell in (("nan", "nan"), ("text", "2 V")):
        texts[name] = [*rows[:5], f"0.05,{cell},0.5", *rows[6:]]
    for name, lines in texts.items():
        (folder / f"{name}.csv").write_text("\n".join(["t,u,theta_u", *lines]) + "\n")
    (folder / "noval.csv").write_text("\n".join(["t,volts,theta_u", *rows]) + "\n")
    shown = drill("rig", "show", cwd=folder).stdout
    (folder / "key.toml").write_text(shown.replace("ktheta", "kthetta"))
    (folder / "type.toml").write_text(shown.replace("Jl = 0.0326", 'Jl = "0.0326"'))
    (folder / "broken").mkdir()
    (folder / "broken" / "agent.json").write_text("{")
    (folder / "broken" / "policy.npz").write_text("")
    return folder


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_line_and_exit_status_2(name, bad_folder, monkeypatch, capsys):
    args, wanted = BAD[name]
    before = sorted(p.relative_to(bad_folder) for p in bad_folder.rglob("*"))
    monkeypatch.chdir(bad_folder)
    monkeypatch.setattr(sys, "argv", ["drill-env", *args])
    with pytest.raises(SystemExit) as ended:
        obey()
    assert ended.value.code == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert len(err.splitlines()) == 1 and err.startswith("error: ")
    assert [part for part in wanted if part not in err] == []
    assert sorted(p.relative_to(bad_folder) for p in bad_folder.rglob("*")) == before


def test_bad_input_from_the_shell(bad_folder):
    done = drill(*BAD["nan cell"][0], cwd=bad_folder)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: nan.csv: column u") and done.stderr.count("\n") == 1


def test_no_arguments_show_the_help(tmp_path):
    assert "Usage:" in drill(cwd=tmp_path).stdout
