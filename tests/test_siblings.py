"""Both names of `agents` and `baselines`: in the checkout, in a wheel, beside strangers."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import textwrap
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
# An editable install has put this checkout on the path: the copies must not see it.
ALONE = f"import sys; sys.path[:] = [p for p in sys.path if p != {str(ROOT)!r}]\n"
FOREIGN = "KIND = 'foreign'\n"
# Stands for any module of ours: a class, a relative import and an absolute one.
PROBE = {
    "baselines/probe.py": (
        "from drill_env._errors import InputError\n\n\nclass Probe(InputError):\n    pass\n"
    ),
    "baselines/deeper/__init__.py": "from ..probe import Probe\n",
    "agents/probe.py": "from drill_env.baselines.probe import Probe\n",
}
SAME_OBJECTS = """
    import pickle, sys
    import drill_env
    import drill_env.baselines.deeper
    from {first}.probe import Probe as One
    from {second}.probe import Probe as Two
    import {first}, {second}, drill_env.agents.probe
    assert {first} is {second} and One is Two is drill_env.agents.probe.Probe
    import baselines.deeper
    assert sys.modules["baselines.deeper"] is drill_env.baselines.deeper
    assert drill_env.baselines.deeper.Probe is One
    assert type(pickle.loads(pickle.dumps(One("x")))) is Two
    assert {first}.__spec__.name == {first}.__name__
"""
SHADOWED = """
    import pickle
    import agents, drill_env
    assert agents.KIND == "foreign"
    from agents.own import KIND
    import drill_env.agents.probe as ours
    assert not hasattr(drill_env.agents, "KIND") and drill_env.agents is not agents
    assert ours.Probe is drill_env.baselines.probe.Probe
    import agents as again
    assert again is agents and again.KIND == KIND == "foreign"
    try:
        import agents.probe
    except ModuleNotFoundError as error:
        assert error.name == "agents.probe", error.name
    else:
        raise AssertionError("ours was put below the foreign package")
"""


def run(code: str, *path: Path, cwd: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, path))}
    done = subprocess.run(
        [sys.executable, "-P", "-c", ALONE + textwrap.dedent(code)],
        env=environment, cwd=cwd, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small checkout: our real finder and packages, plus the probes."""
    root = tmp_path_factory.mktemp("checkout")
    ignore = shutil.ignore_patterns("__pycache__")
    for name in ("drill_env", "agents", "baselines"):
        shutil.copytree(ROOT / name, root / name, ignore=ignore)
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, root / name)
    for name in ("agents", "baselines"):
        (root / name / "__init__.py").write_text('"""Bare, so that only names are tested."""\n')
    for name, text in PROBE.items():
        (root / name).parent.mkdir(exist_ok=True)
        (root / name).write_text(text)
    return root


@pytest.fixture(scope="module")
def wheel(checkout: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of that checkout."""
    from hatchling.builders.wheel import WheelBuilder

    folder = tmp_path_factory.mktemp("wheel")
    (built,) = WheelBuilder(str(checkout)).build(directory=str(folder), versions=["standard"])
    return Path(built)


@pytest.fixture(scope="module")
def unpacked(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    return folder


@pytest.fixture
def foreign(tmp_path: Path) -> Iterator[Path]:
    """A folder of another distribution that owns the name `agents`."""
    package = tmp_path / "other" / "agents"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text(FOREIGN)
    (package / "own.py").write_text(FOREIGN)
    yield package.parent


def test_same_objects_in_this_checkout():
    import agents
    import baselines
    import drill_env.agents
    import drill_env.baselines

    assert drill_env.agents is agents
    assert drill_env.baselines is baselines


@pytest.mark.parametrize("short_first", [True, False])
def test_checkout_gives_one_module_under_both_names(checkout, tmp_path, short_first):
    names = ["baselines", "drill_env.baselines"]
    first, second = names if short_first else names[::-1]
    run(SAME_OBJECTS.format(first=first, second=second), checkout, cwd=tmp_path)


@pytest.mark.parametrize("short_first", [True, False])
def test_wheel_gives_one_module_under_both_names(unpacked, tmp_path, short_first):
    names = ["baselines", "drill_env.baselines"]
    first, second = names if short_first else names[::-1]
    run(SAME_OBJECTS.format(first=first, second=second), unpacked, cwd=tmp_path)


def test_foreign_agents_keep_working_beside_a_checkout(checkout, foreign, tmp_path):
    run(SHADOWED, foreign, checkout, cwd=tmp_path)


@pytest.mark.parametrize("foreign_first", [True, False])
def test_foreign_agents_keep_working_beside_a_wheel(unpacked, foreign, tmp_path, foreign_first):
    path = [foreign, unpacked] if foreign_first else [unpacked, foreign]
    run(SHADOWED, *path, cwd=tmp_path)


def test_finders_are_installed_once():
    from drill_env import _siblings

    before = list(sys.meta_path)
    _siblings.install()
    assert sys.meta_path == before


@pytest.mark.parametrize("name", ["drill_env.baselines.nothing", "baselines.nothing"])
def test_missing_module_is_reported_by_its_own_name(checkout, unpacked, tmp_path, name):
    code = f"""
        import drill_env
        try:
            import {name}
        except ModuleNotFoundError as error:
            assert error.name == "{name}", error.name
        else:
            raise AssertionError
    """
    run(code, checkout, cwd=tmp_path)
    run(code, unpacked, cwd=tmp_path)


def test_modules_run_as_scripts_under_both_names(checkout, unpacked, tmp_path):
    for path in (checkout, unpacked):
        for name in ("baselines.probe", "drill_env.baselines.probe"):
            run(
                f"import runpy, drill_env; runpy.run_module({name!r}, run_name='x')",
                path,
                cwd=tmp_path,
            )


def test_wheel_owns_one_name_and_ships_its_types(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    assert {n.split("/")[0] for n in names if ".dist-info" not in n} == {"drill_env"}
    assert {"drill_env/py.typed", "drill_env/agents/__init__.py"} <= set(names)
    assert "drill_env/baselines/deeper/__init__.py" in names
    parts = {part for name in names for part in name.split("/")}
    assert not parts & {"tests", "benchmarks", "typings", "train.py", "__pycache__"}
