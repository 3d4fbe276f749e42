"""How compiled code is made: every kernel of the project passes through here.

Numba links whatever a function calls into that function and optimises the whole again. What is
large is therefore compiled once, alone, and called by its address: a `unit`.
"""

from __future__ import annotations

import functools
import gc
import hashlib
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from llvmlite import ir
from numba import njit, types
from numba.core import event
from numba.core.dispatcher import Dispatcher
from numba.core.typing.templates import signature as typed
from numba.extending import intrinsic

from drill_env._compiling import Compiling, add_seconds, announce
from drill_env._part_compiler import FITS, PartCompiler

F = TypeVar("F", bound=Callable[..., Any])

_OPTIONS: dict[str, Any] = {
    # Compiled code is kept on disk, so only the first call on a machine pays.
    "cache": True,
    # Batches run on plain threads.
    "nogil": True,
    "error_model": "numpy",
    # Kernels allocate nothing, so they need no reference counts; counting them took
    # two thirds of the time of a step.
    "_nrt": False,
    # Not even fused multiply-add: which products are fused depends on what a function was linked
    # with, so that code from the cache would round otherwise than code just compiled.
    "fastmath": False,
    "no_cfunc_wrapper": True,
}
# What Python never calls needs no wrapper; those took half of the time to compile.
_INNER = {**_OPTIONS, "no_cpython_wrapper": True}


def _compiled(function: Callable[..., Any], **options: Any) -> Any:
    decorate: Any = njit
    try:
        made = decorate(**options)(function)
    except RuntimeError:
        # No folder for the cache can be written, or the function stands in no file.
        return decorate(**{**options, "cache": False})(function)
    made._compiler.fold_argument_types = functools.partial(
        _folded, made._compiler.fold_argument_types
    )
    kept = getattr(getattr(made, "_cache", None), "_cache_file", None)
    if kept is not None:
        # Numba looks at the function's own file alone, but links what others hold.
        kept._source_stamp = (kept._source_stamp, _package_stamp())
        kept._load_index = functools.partial(_known, kept._load_index)
    return made


def _folded(fold: Callable[[Any, Any], Any], arguments: Any, named: Any) -> Any:
    """What a call is compiled for: once for all constants, not for each."""
    declared, kinds = fold(arguments, named)
    return declared, tuple(map(types.unliteral, kinds))


def _known(load: Callable[[], Any]) -> Any:
    """What the cache holds; nothing where it names modules of an older version."""
    try:
        return load()
    except (ImportError, AttributeError):
        return {}


@functools.cache
def _package_stamp() -> str:
    """Changes when any file of the package does."""
    root = Path(__file__).parent
    folders = [root, root.parent / "baselines", root.parent / "agents"]
    marks = hashlib.sha1(usedforsecurity=False)
    for path in sorted(p for folder in folders for p in folder.rglob("*.py")):
        stat = path.stat()
        marks.update(f"{path.relative_to(root.parent)} {stat.st_mtime_ns} {stat.st_size}".encode())
    return marks.hexdigest()


class _Watch(event.Listener):
    """Tells how many of the kernels that a compilation needs are done.

    Nor does Python look for garbage meanwhile, which took an eighth of the time: hardly any of what
    a compiler makes is garbage.
    """

    def __init__(self) -> None:
        self._needed: set[Dispatcher] = set()
        self._depth = 0
        self._collects = False
        self._began = 0.0

    def on_start(self, event: Any) -> None:
        """A kernel begins."""
        made = event.data["dispatcher"]
        if self._depth == 0:
            self._needed = (
                _reachable(made) if (made.__module__ or "").partition(".")[0] in _OURS else set()
            )
            self._collects = gc.isenabled()
            gc.disable()
            self._began = time.thread_time()
        self._depth += 1
        self._tell(made, finished=False)

    def on_end(self, event: Any) -> None:
        """A kernel is compiled."""
        self._depth -= 1
        if self._depth == 0:
            add_seconds(time.thread_time() - self._began)
            self._tell(event.data["dispatcher"], finished=True)
            if self._collects:
                gc.enable()

    def _tell(self, made: Dispatcher, finished: bool) -> None:
        if self._needed:
            done = sum(bool(kernel.overloads) for kernel in self._needed)
            announce(Compiling(done, len(self._needed), made.py_func.__name__, finished))


_OURS = ("drill_env", "agents", "baselines")


def _reachable(made: Dispatcher) -> set[Dispatcher]:
    """A kernel and all that it calls, itself or through others."""
    found, pending = {made}, [made]
    while pending:
        function = pending.pop().py_func
        new = _called(function) - found
        found |= new
        pending += new
    return found


def _called(function: Callable[..., Any]) -> set[Dispatcher]:
    """The kernels that a function names."""
    named = (function.__globals__.get(name) for name in function.__code__.co_names)
    return {kernel for kernel in named if isinstance(kernel, Dispatcher)}


@functools.cache
def names_in(made: Unit) -> frozenset[str]:
    """Names and attributes that the source of a unit, or of a kernel it calls, mentions."""
    reached = set().union(*(_reachable(kernel) for kernel in _called(made.function)))
    functions = [made.function, *(kernel.py_func for kernel in reached)]
    return frozenset(name for function in functions for name in function.__code__.co_names)


event.register("numba:compile", _Watch())


_PART = {**_INNER, "cache": False, "pipeline_class": PartCompiler} if FITS else _INNER


def entry(function: F) -> F:
    """Compile a kernel that Python calls.

    The function must not allocate: working arrays are handed in by the caller.
    """
    return _compiled(function, **_OPTIONS)


def kernel(function: F) -> F:
    """As `entry`, for what only other kernels call."""
    return _compiled(function, **_PART)


def inlined(function: F) -> F:
    """As `kernel`, and melted into every caller: for short formulas that run in every stage."""
    return _compiled(function, forceinline=True, **_PART)


class Unit:
    """Compiled code of one signature that is called by its address.

    Attributes:
        function: the Python source.
        signature: types of the result and the arguments.
        call: for kernels: `call(address, *arguments)`.
    """

    def __init__(self, function: Callable[..., Any], signature: Any, call: Any) -> None:
        self.function = function
        self.signature = signature
        self.call = call
        self._compiled: Any = _compiled(function, **_INNER)
        # Pickled by name: an address means nothing to another process.
        self.__module__, self.__qualname__ = function.__module__, function.__qualname__

    @functools.cached_property
    def address(self) -> int:
        """Where the machine code lies in this process; compiles it at the first look."""
        return self.address_for(self.signature)

    def address_for(self, signature: Any) -> int:
        """The same code for arguments of other types."""
        self._compiled.compile(signature)
        result = self._compiled.overloads[signature.args]
        return result.library.get_pointer_to_function(result.fndesc.llvm_func_name)

    def __reduce__(self) -> str:
        return self.__qualname__


def caller(*signatures: Any) -> Any:
    """What kernels call code at an address with: `call(address, *arguments)`.

    Args:
        *signatures: of the code, by the types of the arguments that it is called with.
    """

    def describe(typing_context: Any, address: Any, *arguments: Any) -> Any:
        fitting = (kind for kind in signatures if kind.args == arguments)
        signature = next(fitting, signatures[0])
        declared = typed(signature.return_type, types.int64, *signature.args)

        def generate(context: Any, builder: Any, _: Any, values: Any) -> Any:
            convention = context.call_conv
            kind = convention.get_function_type(signature.return_type, signature.args)
            code = builder.inttoptr(values[0], ir.PointerType(kind))
            _, out = convention.call_function(
                builder, code, signature.return_type, signature.args, values[1:]
            )
            return out

        return declared, generate

    names = ", ".join(f"a{i}" for i in range(len(signatures[0].args)))
    scope: dict[str, Any] = {"describe": describe}
    # An intrinsic's arguments must be named one by one.
    exec(f"def call(context, address, {names}): return describe(context, address, {names})", scope)
    return intrinsic(scope["call"])


def unit(signature: Any) -> Callable[[Callable[..., Any]], Unit]:
    """Compile a function alone, when its address is first asked for.

    Args:
        signature: of numba, `result(arguments)`.
    """
    return lambda function: Unit(function, signature, caller(signature))
