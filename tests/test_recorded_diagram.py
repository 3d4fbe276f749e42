"""Recordings at constant voltages against the computed diagram, and the command that draws it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from test_cli import drill

from drill_env import InputError, Rig
from drill_env.cli.main import obey
from drill_env.continuation import bifurcation_diagram
from drill_env.identification.recorded_diagram import recorded_points
from drill_env.recordings import Recording, read_recording

pytestmark = pytest.mark.filterwarnings("ignore::drill_env.recordings.RecordingWarning")

# One count of 8192 over the smoothing window, and what smoothing takes off the peaks.
RESTING, TURNING, PEAK, TROUGH = 1e-9, 5e-3, 0.01, 0.06
PROMISED = ["diagram.csv", "diagram.parquet", "points.json", "diagram.png", "diagram.html"]


@pytest.fixture(scope="module")
def recordings(tmp_path_factory) -> dict[float, Path]:
    folder = tmp_path_factory.mktemp("recorded")
    paths = {}
    for volts in (0.05, 0.4, 1.0, 2.5, 4.0):
        path = folder / f"at-{volts}.csv"
        done = drill(
            "simulate", f"--volts={volts}", "--seconds=120", "--encoder", f"--out={path}",
            cwd=folder,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        paths[volts] = path
    return paths


def test_recorded_points_lie_on_the_computed_diagram(recordings):
    diagram = bifurcation_diagram(Rig(), 5.0)
    read = [read_recording(path, need=("u",)) for path in recordings.values()]
    table = recorded_points(read, diagram, settle=0.6).set_index("voltage")
    assert table.vibrates.to_dict() == {0.05: False, 0.4: False, 1.0: True, 2.5: True, 4.0: True}
    assert abs(table.error_max[0.05]) <= RESTING
    assert abs(table.error_max[0.4]) <= TURNING
    for volts in (1.0, 2.5, 4.0):
        assert abs(table.error_max[volts]) <= PEAK * table.computed_max[volts]
        assert abs(table.error_min[volts]) <= TROUGH


def test_exact_velocities_leave_only_the_sampling_error():
    from drill_env.integrator import simulate

    run = simulate(Rig(), 3.5, 120.0, rate=200.0)
    made = Recording(
        t=run.t, u=np.full(len(run.t), 3.5), theta_u=None, theta_l=None, source="exact",
        extra={"omega_l": run.omega_l},
    )  # fmt: skip
    row = recorded_points([made], bifurcation_diagram(Rig(), 5.0)).iloc[0]
    # The diagram is interpolated between its points.
    assert abs(row.error_max) < 5e-3 and abs(row.error_min) < 5e-3


def test_recordings_that_cannot_be_placed_are_refused(recordings):
    read = read_recording(recordings[0.4], need=("u",))
    with pytest.raises(InputError, match="raise --to"):
        recorded_points([read], bifurcation_diagram(Rig(), 0.3))
    with pytest.raises(InputError, match="settle"):
        recorded_points([read], settle=1.0)
    moving = Recording(
        t=read.t, u=np.linspace(0.0, 1.0, len(read.t)), theta_u=None, theta_l=read.theta_l,
        source="ramp.csv",
    )  # fmt: skip
    with pytest.raises(InputError, match="constant"):
        recorded_points([moving])


@pytest.fixture(scope="module")
def drawn(recordings, tmp_path_factory):
    folder = tmp_path_factory.mktemp("drawn")
    laid = [f"--recorded={path}" for path in recordings.values()]
    done = drill("bifurcation", "--to=15", "--out=d", "--json", *laid, cwd=folder)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), folder / "d"


def test_the_command_writes_what_it_promises(drawn):
    report, folder = drawn
    assert sorted(path.name for path in folder.iterdir()) == sorted([*PROMISED, "recorded.csv"])
    assert report["failures"] == [] and len(report["recorded"]) == 5
    points = json.loads((folder / "points.json").read_text())
    assert points == report["points"]
    assert {p["name"] for p in points} == {"A", "B", "C", "D", None}
    named = {p["name"]: p for p in points}
    assert named["C"]["error"] < 1e-6 and len(named["C"]["multipliers"]) == 2
    table = pd.read_csv(folder / "diagram.csv")
    again = pd.read_parquet(folder / "diagram.parquet")
    assert len(table) == len(again) > 700
    assert (folder / "diagram.png").read_bytes().startswith(b"\x89PNG")


def test_the_page_holds_a_closed_cycle_behind_every_marker(drawn):
    page = (drawn[1] / "diagram.html").read_text()
    cycles = json.loads(re.search(r"const cycles = (\[.*?\]);\n", page).group(1))  # pyright: ignore
    assert "plotly_click" in page and "http" not in re.sub(
        r"<script.*?</script>", "", page, flags=re.S
    )
    for cycle in cycles[:: max(1, len(cycles) // 10)]:
        assert cycle["omega_l"][0] == pytest.approx(cycle["omega_l"][-1], abs=2e-5)
        assert cycle["t"][-1] == pytest.approx(cycle["period"], abs=1e-5)
    keys = [int(key) for key in re.findall(r"\[(\d+),4\.\d+,", page)]
    assert keys and max(keys) < len(cycles)


@pytest.mark.parametrize(
    ("options", "files"),
    [
        (["--to=20", "--volts=13.6", "--basin=1,15,15", "--starts=40"], ["basin.csv", "basin.png"]),
        (
            ["--parameter=ktheta", "--volts=3.5", "--range=0.07,0.09"],
            ["ktheta-cycles.csv", "ktheta-equilibria.csv", "ktheta.png"],
        ),
        (["--map=T2", "--range=-0.3,-0.2,2"], ["map-T2.csv", "map-T2.png"]),
    ],
)
def test_other_modes_write_their_files(options, files, tmp_path):
    done = drill("bifurcation", *options, "--out=d", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert [Path(path).name for path in report["files"]] == files
    assert all((tmp_path / path).stat().st_size > 100 for path in report["files"])


@pytest.mark.parametrize(
    ("options", "remedy"),
    [
        (["--to=0.01"], "break-away"),
        (["--parameter=ktheta"], "--volts"),
        (["--parameter=mass", "--volts=3", "--range=1,2"], "give one of"),
        (["--map=T2", "--range=1,2"], "LOW,HIGH,N"),
        (["--basin=1,2", "--volts=3"], "three half widths"),
        (["--basin=1,2,3", "--volts=0.01"], "more than"),
        (["--controller=magic"], "pi"),
        (["--controller=pi", "--range=2"], "low,high"),
        (["--controller=pi", "--range=3,2"], "smaller one first"),
        (["--recorded=none.csv"], "none.csv"),
        (["--map=T2", "--parameter=T2"], "one of"),
    ],
)
def test_bad_input_names_the_remedy_in_one_line(options, remedy, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["drill-env", "bifurcation", *options, "--out=d"])
    with pytest.raises(SystemExit) as end:
        obey()
    out, err = capsys.readouterr()
    assert end.value.code == 2 and out == ""
    assert err.count("\n") == 1 and remedy in err
