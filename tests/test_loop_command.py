"""The bifurcation command for controlled rigs: what it writes, and what the loop settles on."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from test_cli import drill

FILES = ["attractors.csv", "diagram.csv", "diagram.html", "diagram.parquet", "diagram.png"]


@pytest.fixture(scope="module")
def drawn(tmp_path_factory) -> tuple[dict, Path]:
    folder = tmp_path_factory.mktemp("controlled")
    done = drill(
        "bifurcation", "--controller=pi", "--range=0.5,2.2", "--out=d", "--json", cwd=folder
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), folder / "d"


def test_the_command_writes_the_whole_diagram(drawn):
    report, folder = drawn
    assert sorted(path.name for path in folder.iterdir()) == sorted([*FILES, "points.json"])
    assert report["failures"] == []
    points = json.loads((folder / "points.json").read_text())
    assert points == report["points"]
    assert [p["kind"] for p in points] == ["neimark-sacker"]
    for name in ("setpoint", "volts", "omega", "period_s", "frequency_rad_s", "how", "error"):
        assert points[0][name] is not None
    table = pd.read_csv(folder / "diagram.csv")
    assert len(table) == len(pd.read_parquet(folder / "diagram.parquet"))
    assert set(table.controller) == {"pi", "none"}
    assert (folder / "diagram.png").read_bytes().startswith(b"\x89PNG")


def test_what_the_loop_settles_on_lies_on_the_computed_branches(drawn):
    """Settled motions are read at the ends of control periods, which clips their peaks."""
    report, folder = drawn
    settled = pd.DataFrame(report["rows"])
    table = pd.read_csv(folder / "diagram.csv")
    ours = table[(table.controller == "pi") & table.stable]
    cycles = ours[ours.kind == "cycle"].sort_values("setpoint")
    limit = report["points"][0]["setpoint"]
    # Close to the limit a swing takes longer to settle than the run lasts.
    away = settled[(settled.setpoint - limit).abs() > 0.1]
    assert (away.stable == (away.setpoint < limit)).all()
    assert ((away.growth_rate < 0.0) == away.stable).all()
    held, swung = away[away.stable], away[~away.stable]
    assert np.abs(held["max"] - held.setpoint).max() < 1e-3
    for side in ("min", "max"):
        computed = np.interp(swung.setpoint, cycles.setpoint, cycles[side])
        assert np.abs(swung[side] - computed).max() < 0.01


def test_the_page_holds_a_closed_cycle_behind_every_marker(drawn):
    page = (drawn[1] / "diagram.html").read_text()
    cycles = json.loads(re.search(r"const cycles = (\[.*?\]);\n", page).group(1))  # pyright: ignore
    assert len(cycles) > 10
    for cycle in cycles:
        assert cycle["omega_l"][0] == pytest.approx(cycle["omega_l"][-1], abs=2e-5)
        assert cycle["t"][-1] == pytest.approx(cycle["period"], rel=0.02)


def test_a_shipped_agent_holds_its_set_points(tmp_path):
    done = drill(
        "bifurcation", "--controller=encoders-ppo", "--range=1,1.2", "--out=d", "--json",
        cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["controller"] == "encoders-ppo" and report["failures"] == []
    assert report["points"] == []
    settled = pd.DataFrame(report["rows"])
    assert settled.stable.all() and (settled.growth_rate < 0.0).all()
    assert (settled["max"] / settled.setpoint - 1.0).abs().max() < 0.05
