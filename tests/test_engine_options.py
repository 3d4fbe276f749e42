"""The options of many runs: one definition, told alike wherever they stand."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import pytest

from drill_env import Engine, InputError
from drill_env.cli._engine_options import EngineKind, counted, duration, engine_of
from drill_env.cli.bifurcation_command import bifurcation_command
from drill_env.cli.compare_command import compare_command
from drill_env.cli.fleet_command import fleet_command
from drill_env.cli.main import app

PAGE = Path(__file__).parents[1] / "docs" / "scaling.md"


def test_commands_with_one_of_the_options_have_all_three_and_stand_on_the_page():
    told = re.findall(r"^\| `drill-env (\w+)", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    found = set()
    for command in app.registered_commands:
        names = inspect.signature(command.callback).parameters  # type: ignore[arg-type]
        options = {"jobs", "engine", "address"} & set(names)
        if options:
            assert options == {"jobs", "engine", "address"}
            found.add(command.name)
    assert found == set(told) == {"compare", "bifurcation", "fleet"}
    for function in (compare_command, bifurcation_command, fleet_command):
        assert inspect.signature(function).parameters["jobs"].default is None


def test_the_options_make_the_engine_they_name():
    assert engine_of(None, EngineKind.LOCAL, None) == Engine()
    assert engine_of(3, EngineKind.RAY, "auto") == Engine("ray", 3, "auto")
    with pytest.raises(InputError, match="engine ray"):
        engine_of(None, EngineKind.LOCAL, "auto")


def test_a_log_is_told_how_much_is_left(monkeypatch, capsys):
    now = [0.0]
    monkeypatch.setattr("drill_env.cli._engine_options.time.monotonic", lambda: now[0])
    with counted("rigs") as watch:
        watch(2, 10)
        for done, seconds in ((3, 4.0), (4, 20.0), (5, 21.0), (10, 80.0)):
            now[0] = seconds
            watch(done, 10)
    assert capsys.readouterr().err.splitlines() == ["rigs: 4 of 10, 1.0 min left ..."]


@pytest.mark.parametrize(
    ("seconds", "text"), [(59.0, "59 s"), (90.0, "1.5 min"), (7200.0, "2.0 h"), (1e6, "11.6 d")]
)
def test_a_duration_is_told_in_the_largest_unit_it_fills(seconds, text):
    assert duration(seconds) == text
