"""Recordings that no such rig can make: a warning that stays with the answer, or an error."""

from __future__ import annotations

import json

import pandas as pd
import pytest
from bad_recordings import simulated
from typer.testing import CliRunner

from drill_env import InputError, Rig
from drill_env.cli.main import app
from drill_env.diagnosis.options import OUTSIDE
from drill_env.effects import LIBRARY

NOTHING = [word for name in (*LIBRARY, *OUTSIDE) for word in ("--leave-out", name)]


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A sound recording, and the same with the voltage's sign turned."""
    folder = tmp_path_factory.mktemp("doubtful")
    made, _ = simulated(11, "quasi-random", rate=100.0, seconds=8.0, rig=Rig.paper())
    table = pd.DataFrame(made)
    table.to_csv(folder / "sound.csv", index=False)
    table.assign(u=-table["u"]).to_csv(folder / "<b>turned.csv", index=False)
    return folder


def run(folder, name, out, *more):
    words = ["diagnose", str(folder / f"{name}.csv"), "--out", str(out), *NOTHING, *more]
    return CliRunner().invoke(app, words)


def test_a_turned_sign_is_a_warning_that_stays_with_the_answer(files, tmp_path):
    sound, turned = run(files, "sound", tmp_path / "a"), run(files, "<b>turned", tmp_path / "b")
    assert sound.exit_code == turned.exit_code == 0
    told = [json.loads((tmp_path / n / "diagnosis.json").read_text()) for n in "ab"]
    assert told[0]["remarks"] == []
    assert len(told[1]["remarks"]) == 1
    assert "sign" in told[1]["remarks"][0]
    # The answer begins with it, and goes on with what the rig says.
    assert len(told[1]["sentences"]) > 1
    assert "of no such rig" in told[1]["sentences"][0]
    assert turned.stdout.startswith(told[1]["sentences"][0])
    pages = [(tmp_path / n / "index.html").read_text() for n in "ab"]
    assert ["Doubtful recordings" in page for page in pages] == [False, True]
    assert "&lt;b&gt;turned.csv: the sign" in pages[1]
    assert "<b>turned" not in pages[1]


def test_strict_refuses_it_before_any_work(files, tmp_path):
    assert run(files, "sound", tmp_path / "a", "--strict").exit_code == 0
    refused = run(files, "<b>turned", tmp_path / "b", "--strict")
    assert isinstance(refused.exception, InputError)
    assert "turned.csv: the sign of u is flipped" in str(refused.exception)
    assert not (tmp_path / "b").exists()
