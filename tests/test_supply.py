"""What is installed: the locks say what `constraints.txt` pins, with a hash for every file."""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import PackageNotFoundError, requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
CORE = [Requirement(text) for text in PROJECT["project"]["dependencies"]]


def pins(path: str) -> dict[str, str]:
    """Canonical name and version of every `name==version` line."""
    text = (ROOT / path).read_text(encoding="utf-8")
    found = re.findall(r"^([\w.-]+)==([\w.+-]+)", text, re.MULTILINE)
    return {canonicalize_name(name): version for name, version in found}


def test_the_whole_lock_pins_what_the_constraints_pin():
    assert pins("supply/all.lock") == pins("constraints.txt")


def test_the_lock_of_the_core_is_a_part_of_the_whole():
    core, whole = pins("supply/core.lock"), pins("supply/all.lock")
    assert core.items() <= whole.items()
    assert "torch" not in core


@pytest.mark.parametrize("lock", ["core", "all", "tools"])
def test_every_line_of_a_lock_is_one_version_or_one_hash(lock: str):
    text = (ROOT / f"supply/{lock}.lock").read_text(encoding="utf-8").replace(" \\\n", "")
    lines = text.splitlines()
    assert len(lines) == len(pins(f"supply/{lock}.lock"))
    hashed = re.compile(r"[\w.-]+==[\w.+-]+( ; [^#\\]+?)?( +--hash=sha256:[0-9a-f]{64})+")
    assert [line for line in lines if not hashed.fullmatch(line)] == []


def test_the_lock_of_the_core_meets_the_project_and_all_that_its_packages_require():
    core = pins("supply/core.lock")
    builds = [Requirement(text) for text in PROJECT["build-system"]["requires"]]
    wanted, seen = [*CORE, *builds], set()
    while wanted:
        need = wanted.pop()
        name = canonicalize_name(need.name)
        assert name in core, f"{name} is missing: make lock"
        assert need.specifier.contains(core[name], prereleases=True), f"{need}: {core[name]}"
        if name in seen:
            continue
        seen.add(name)
        try:
            further = [Requirement(text) for text in requires(name) or ()]
        except PackageNotFoundError:  # of the development extra, absent from a plain install
            continue
        # An extra that a requirement names is followed through the lock's own resolution.
        wanted += [r for r in further if r.marker is None or r.marker.evaluate({"extra": ""})]
    assert len(seen) > len(CORE)
