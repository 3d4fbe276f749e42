"""The packages as rooms: private modules stay inside, and imports go one way."""

from __future__ import annotations

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import drill_env

ROOT = Path(drill_env.__file__).parent


def imports() -> list[tuple[str, str]]:
    """Every module of the package with each module that it imports at its top."""
    found = []
    for path in sorted(ROOT.rglob("*.py")):
        parts = ("drill_env", *path.relative_to(ROOT).with_suffix("").parts)
        name = ".".join(parts).removesuffix(".__init__")
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for node in tree.body:
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("drill_env"):
                found.append((name, str(node.module)))
    return found


def package_of(module: str) -> str:
    """The package that a module is in: the folder right under `drill_env`."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 and (ROOT / parts[1]).is_dir() else "drill_env"


def test_no_package_reaches_into_anothers_private_modules():
    pairs = imports()
    assert len(pairs) > 500
    wrong = []
    for name, module in pairs:
        parts = module.split(".")
        hidden = [i for i, part in enumerate(parts) if part.startswith("_")]
        if hidden and not f"{name}.".startswith(".".join(parts[: hidden[0]]) + "."):
            wrong.append(f"{name} imports {module}")
    assert wrong == []


def test_imports_between_packages_have_no_circle():
    needs: dict[str, set[str]] = {}
    for name, module in imports():
        here, there = package_of(name), package_of(module)
        # What is right under `drill_env` is the package's face, or shared by all.
        if "drill_env" not in (here, there) and here != there:
            needs.setdefault(here, set()).add(there)
    order = list(TopologicalSorter(needs).static_order())
    flow = ["parameters", "friction", "dynamics", "integrator", "identification", "diagnosis"]
    assert [p for p in order if p in flow] == flow
