"""The place of the code of a kernel and of its parts: parts as LLVM's code only, machine code of whole kernels alone.

numba makes machine code of each function that it compiles.  That of a part is never run, for the
kernel has the part's LLVM code inside: a tenth of the compiling, for nothing.
"""

from typing import Any

from numba.core import codegen as numba_codegen
from numba.core.environment import lookup_environment

codegen: Any = numba_codegen


class KernelLibrary(codegen.JITCodeLibrary):  # type: ignore[misc]
    """The code of a kernel, with the parts in it."""

    def _finalize_specific(self) -> None:
        """Make machine code, and show it the objects that its parts print or raise, as numba would each by itself."""
        super()._finalize_specific()
        for name in [variable.name for variable in self._final_module.global_variables]:
            if (environment := lookup_environment(name)) is not None:
                self._codegen.set_env(name, environment)


class PartLibrary(codegen.JITCodeLibrary):  # type: ignore[misc]
    """The code of a part, optimised and ready to be linked into others."""

    @property
    def codegen(self) -> Any:
        """The part's objects: this library, which leaves them to the kernel's."""
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """Nothing: there is no machine code yet that could see them."""

    def get_pointer_to_function(self, name: str) -> int:
        """No address, as of any function that cannot be called from Python."""
        self._ensure_finalized()
        return 0

    def _finalize_final_module(self) -> None:
        """All but machine code."""
        self._finalize_dynamic_globals()
        self._finalized = True
