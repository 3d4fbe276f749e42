"""What is installed: locks with hashes, licences, an audit that claims no more than it knows."""

from __future__ import annotations

import json
import re
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, requires
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

from supply import licences
from supply.audit import audit

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


def table_of_licences() -> dict[str, list[str]]:
    page = (ROOT / "docs/licences.md").read_text(encoding="utf-8").partition(licences.HEADING)[2]
    rows = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| ")]
    return {row[0]: row[1:] for row in rows[2:]}


def test_every_pinned_package_stands_in_the_table_of_licences_or_is_named_as_absent():
    table, pinned = table_of_licences(), pins("constraints.txt")
    core = {name for name, row in table.items() if row[1] == "core"}
    assert {canonicalize_name(need.name) for need in CORE} <= core
    absent = {name for name in pinned if name.startswith(("cuda-", "nvidia-")) or name == "triton"}
    assert table.keys() == pinned.keys() - absent
    for name, (version, *_) in table.items():
        assert Version(version).public == pinned[name], f"{name}: make licences"


def test_what_is_not_permissive_is_explained_above_the_table():
    prose = (ROOT / "docs/licences.md").read_text(encoding="utf-8").partition(licences.HEADING)[0]
    strict = [name for name, row in table_of_licences().items() if row[2] != "permissive"]
    assert "slycot" in strict
    assert [name for name in strict if f"`{name}`" not in prose] == []


@pytest.mark.parametrize(
    ("licence", "kind"),
    [
        ("Apache-2.0 OR BSD-2-Clause", "permissive"),
        ("BSD License; MIT License", "permissive"),
        ("GPL-2.0 AND BSD-3-Clause", "copyleft"),
        ("AGPL-3.0-only", "copyleft"),
        ("GNU Library or Lesser General Public License (LGPL)", "weak copyleft"),
        ("LGPL-2.1-or-later", "weak copyleft"),
        ("MIT AND MPL-2.0", "weak copyleft"),
        ("LicenseRef-NVIDIA-Proprietary", "to be read"),
        ("MIT AND LicenseRef-Own", "to be read"),
        ("not named", "to be read"),
    ],
)
def test_the_strictest_part_of_a_licence_counts(licence: str, kind: str):
    assert licences.kind_of(licence) == kind


def stand_in(tmp_path: Path, packages: list[dict[str, Any]] | None, status: int) -> list[str]:
    """A program that ends as pip-audit does, with or without its report."""
    program = tmp_path / "stand_in.py"
    write = f"open(sys.argv[-1], 'w').write({json.dumps({'dependencies': packages})!r})"
    write = write if packages is not None else "print('cannot resolve host', file=sys.stderr)"
    program.write_text(f"import sys\n{write}\nsys.exit({status})\n", encoding="utf-8")
    return [sys.executable, str(program)]


CLEAN = {"name": "numpy", "version": "2.4.6", "vulns": []}
SKIPPED = {"name": "scipy", "skip_reason": "Dependency not found on PyPI"}
FOUND = {**CLEAN, "vulns": [{"id": "PYSEC-1", "fix_versions": ["2.5"], "aliases": []}]}


@pytest.mark.parametrize(
    ("packages", "ends", "status", "said"),
    [
        ([CLEAN], 0, 0, "none known for 1 packages"),
        ([CLEAN, FOUND], 1, 1, "numpy 2.4.6: PYSEC-1, mended in 2.5"),
        ([FOUND, SKIPPED], 1, 1, "1 packages not looked up"),
        # pip-audit calls this clean.
        ([CLEAN, SKIPPED], 0, 2, "nothing is claimed: 1 of 2"),
        ([], 0, 2, "nothing is claimed"),
        (None, 1, 2, "nothing is claimed: pip-audit wrote no report: cannot resolve host"),
    ],
)
def test_an_audit_is_clean_only_when_every_package_was_looked_up(
    tmp_path: Path, packages: list[dict[str, Any]] | None, ends: int, status: int, said: str
):
    report = tmp_path / "out" / "audit.json"
    report.parent.mkdir()
    report.write_text('{"dependencies": []}', encoding="utf-8")  # of an earlier run
    got, words = audit(report, stand_in(tmp_path, packages, ends))
    assert got == status
    assert said in words
