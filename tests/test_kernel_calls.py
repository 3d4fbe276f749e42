"""Python calls entries alone: a kernel without a wrapper would crash the interpreter."""

import ast
import importlib
from pathlib import Path
from types import ModuleType

import pytest
from numba.core.dispatcher import Dispatcher

ROOT = Path(__file__).parents[1]
MADE = {"kernel", "entry", "inlined"}
FILES = [
    path
    for folder in ("drill_env", "baselines", "agents", "tests")
    for path in sorted((ROOT / folder).rglob("*.py"))
    if "import" in path.read_text("utf-8")
]


def decorated(node, effects):
    names = {
        getattr(d, "id", getattr(getattr(d, "func", d), "id", "")) for d in node.decorator_list
    }
    return bool(names & {*MADE, "unit", "response", "effect", *effects})


def effects_of_one_part(tree):
    """Names that a file gives to the decorator `effect` with its first arguments filled in."""
    return {
        target.id
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call)
        if getattr(node.value.func, "id", "") == "partial"
        if getattr(node.value.args[0], "id", "") == "effect"
        for target in node.targets
        if isinstance(target, ast.Name)
    }


def called_from_python(tree):
    """Names that are used outside of kernels."""
    pending, names, effects = [tree], set(), effects_of_one_part(tree)
    while pending:
        node = pending.pop()
        if isinstance(node, ast.FunctionDef) and decorated(node, effects):
            continue
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
            names.add(node.id)
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            names.add(f"{node.value.id}.{node.attr}")
        pending += ast.iter_child_nodes(node)
    return names


def imported(tree, path):
    """What the file imports from the package, at its top and inside functions, and defines."""
    module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    own = path.relative_to(ROOT).parts[0] != "tests"
    scope = dict(vars(importlib.import_module(module))) if own else {}
    for node in ast.walk(tree):
        if not isinstance(node, ast.ImportFrom):
            continue
        source = "." * node.level + (node.module or "")
        if not source.startswith((".", "drill_env", "baselines", "agents")):
            continue
        for name in node.names:
            # As the statement does: a module that was not imported yet is no attribute.
            given = importlib.import_module(source, module.rpartition(".")[0])
            found = getattr(given, name.name, None)
            if found is None:
                found = importlib.import_module(f"{given.__name__}.{name.name}")
            scope.setdefault(name.asname or name.name, found)
    return scope


def without_wrapper(scope, name):
    """Whether a name, or an attribute of a module, is such a kernel."""
    first, _, rest = name.partition(".")
    found = scope.get(first)
    if rest and isinstance(found, ModuleType):
        found = getattr(found, rest, None)
    return isinstance(found, Dispatcher) and found.targetoptions.get("no_cpython_wrapper")


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_python_calls_only_what_has_a_wrapper(path):
    tree = ast.parse(path.read_text("utf-8"))
    if not any(isinstance(n, (ast.Import, ast.ImportFrom, ast.FunctionDef)) for n in tree.body):
        return
    names = called_from_python(tree)
    scope = imported(tree, path)
    bare = [name for name in sorted(names) if without_wrapper(scope, name)]
    assert not bare, f"{bare}: decorate with entry instead of kernel or inlined"
