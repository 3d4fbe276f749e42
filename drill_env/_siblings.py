"""The packages `agents` and `baselines`, each under two names and loaded once.

They lie beside `drill_env` in a checkout and inside it in a wheel. Either way
`drill_env.agents` and `drill_env.baselines` work, and so do the short names, unless
another distribution owns them: then that one keeps them, and ours keep the long ones.
A module is the same object under both names, so classes and pickles agree.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import find_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

SIBLINGS = ("agents", "baselines")

_INSIDE = Path(__file__).resolve().parent
_CHECKOUT = _INSIDE.parent


class _AliasLoader(Loader):
    """Hands out a module that is known under another name."""

    def __init__(self, target: str) -> None:
        self.target = target
        self.spec: ModuleSpec | None = None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        module = importlib.import_module(self.target)
        self.spec = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        # The import system has just put the alias' spec in; relative imports need the true one.
        module.__spec__ = self.spec

    def get_code(self, fullname: str) -> object:
        """The code object, so that ``python -m`` works under both names."""
        spec = find_spec(self.target)
        return spec.loader.get_code(self.target) if spec and spec.loader else None  # pyright: ignore


class _Submodules(MetaPathFinder):
    """First in line: below an aliased package every module is an alias too.

    The ordinary path finder would load it a second time.
    """

    def __init__(self, roots: dict[str, str]) -> None:
        self.roots = roots

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        for alias, name in self.roots.items():
            if fullname.startswith(f"{alias}."):
                package = sys.modules.get(alias)
                if package is None or package.__name__ != name:
                    return None
                return _alias(fullname, name + fullname[len(alias) :])
        return None


class _CheckoutRoots(MetaPathFinder):
    """First in line in a checkout: `drill_env.agents` is the folder beside `drill_env`."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        parent, _, name = fullname.partition(".")
        if parent != _INSIDE.name or name not in SIBLINGS:
            return None
        source = _CHECKOUT / name / "__init__.py"
        if _is_ours(name, source):
            return _alias(fullname, name)
        return spec_from_file_location(fullname, source)


class _ShortNames(MetaPathFinder):
    """Last in line in a wheel: `agents` is ours only if nobody else has one."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        return _alias(fullname, f"{_INSIDE.name}.{fullname}") if fullname in SIBLINGS else None


def _alias(fullname: str, target: str) -> ModuleSpec | None:
    if find_spec(target) is None:
        return None
    return ModuleSpec(fullname, _AliasLoader(target))


def _is_ours(name: str, source: Path) -> bool:
    module = sys.modules.get(name)
    if module is not None:
        origin = getattr(module, "__file__", None)
    else:
        spec = find_spec(name)
        origin = spec.origin if spec else None
    return origin is not None and Path(origin).resolve() == source.resolve()


def install() -> None:
    """Let both names of the two packages work; called when `drill_env` is imported."""
    if any(isinstance(finder, _Submodules) for finder in sys.meta_path):
        return
    inside = {name: f"{_INSIDE.name}.{name}" for name in SIBLINGS}
    if all((_INSIDE / name / "__init__.py").is_file() for name in SIBLINGS):
        sys.meta_path.insert(0, _Submodules(inside))
        sys.meta_path.append(_ShortNames())
    else:
        outside = {long: short for short, long in inside.items()}
        sys.meta_path[:0] = [_Submodules(outside), _CheckoutRoots()]
