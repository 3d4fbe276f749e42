"""Compiles kernels that only other kernels call: linked into those, and optimised there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
from numba._dynfunc import make_function
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

FITS = numba.version_info.short <= (0, 68)
"""Whether numba's insides are known to be those that `PartCompiler` builds on.

A later version compiles by itself, for longer.
"""


class _Part(JITCodeLibrary):
    """Code that is linked into what calls it, and gets no machine code of its own."""

    def finalize(self) -> None:
        """Link in what it calls; whoever is called by its address optimises all of it, once."""
        for part in dict.fromkeys(self._linking_libraries):
            self._final_module.link_in(part._get_module_for_linking(), preserve=True)
        self._finalized = True


class PartCompiler(Compiler):
    """Stops where numba would make machine code."""

    def compile_extra(self, func: Callable[..., Any]) -> Any:
        """Compile a function of Python."""
        state = self.state
        state.library = _Part(state.targetctx.codegen(), func.__qualname__)
        state.flags.no_compile = True
        found = super().compile_extra(func)
        # Numba knows what kernels call by the object that Python would call.
        name = func.__qualname__
        called = make_function(
            found.fndesc.lookup_module(), name, name, 0, found.environment, (found.library,)
        )
        found = found._replace(entry_point=called)
        state.targetctx.insert_user_function(found.entry_point, found.fndesc, [found.library])
        return found
