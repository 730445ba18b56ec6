"""Kernels whose results have no NamedTuple."""

from collections.abc import Iterator
from typing import Any

import numba
from numba.core.registry import CPUDispatcher


class PlainKernel(CPUDispatcher):
    """A function compiled for calls from Python."""

    def compile(self, sig: Any) -> Any:
        """Compile for arguments of these types; TypeError for a result with a NamedTuple.

        Numba calls its class, which fails after ^C, and does not notice: the process crashes.
        """
        entry = super().compile(sig)
        result = self.nopython_signatures[-1].return_type
        if any(isinstance(part, numba.types.BaseNamedTuple) for part in _with_parts(result)):
            raise TypeError(f"{self.py_func.__qualname__} must return plain tuples, not {result}")
        return entry


def _with_parts(kind: Any) -> Iterator[Any]:
    """A type, and the types of the items of tuples at any depth."""
    yield kind
    for part in getattr(kind, "types", ()):
        yield from _with_parts(part)
