"""How this package compiles: three decorators over numba with one set of flags and one cache.

numba's own cache looks only at the file of the function that it stores; here a kernel is made
of functions from several files, so the cache folder is named by a hash of all of them.
"""

import hashlib
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
import platformdirs
from numba.core import config as numba_config

config: Any = numba_config
F = TypeVar("F", bound=Callable[..., Any])

# The compiler may contract and reorder, but nan and infinity keep their meaning (no `nnan`,
# no `ninf`): a response that blows up must be seen.
FLAGS: dict[str, Any] = {
    "fastmath": {"contract", "reassoc", "nsz", "arcp"},
    "error_model": "numpy",
}


@cache
def _cache_folder() -> str | None:
    """Folder of the machine code of exactly these sources; None where none can be written."""
    package = Path(__file__).parents[2]
    digest = hashlib.sha256()
    for source in sorted([*package.glob("mechanics/**/*.py"), *package.glob("circuit/**/*.py")]):
        digest.update(source.read_bytes())
    base = config.CACHE_DIR or platformdirs.user_cache_dir("harvester")
    folder = Path(base) / f"kernels-{digest.hexdigest()[:16]}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / ".writable").touch()
    except OSError:
        return None
    return str(folder)


@contextmanager
def _own_cache() -> Iterator[bool]:
    """Point numba at our folder while a function is decorated; yields whether there is one."""
    folder, previous = _cache_folder(), config.CACHE_DIR
    config.CACHE_DIR = folder or previous
    try:
        yield folder is not None
    finally:
        config.CACHE_DIR = previous


@dataclass
class Compilation:
    """Seconds that the first call of a kernel took: long once for each set of effects, then read from the cache."""

    seconds: float = 0.0


@contextmanager
def compilation() -> Iterator[Compilation]:
    """Time the first call of a kernel; on a terminal, say what is going on if it takes long."""
    took, begin = Compilation(), time.perf_counter()
    teller = threading.Timer(0.5, _tell)
    teller.daemon = True
    teller.start()
    try:
        yield took
    finally:
        teller.cancel()
        took.seconds = time.perf_counter() - begin


def _tell() -> None:
    if sys.stderr.isatty():
        print("compiling the kernel for this scene's effects: some seconds, once; it is cached", file=sys.stderr)


def inlined(function: F) -> F:
    """Compile a small function that a kernel calls; LLVM inlines it."""
    return numba.njit(**FLAGS)(function)  # type: ignore[no-any-return]


def forced(function: F) -> F:
    """`inlined`, whatever its size.

    A call that is left cannot become vector instructions, and counts references to its arrays with atomic operations:
    up to twenty times slower.
    """
    return numba.njit(forceinline=True, **FLAGS)(function)  # type: ignore[no-any-return]


def kernel(function: F) -> F:
    """Compile a function called from Python: cached on disk, free of the interpreter's lock."""
    with _own_cache() as cached:
        return numba.njit(cache=cached, nogil=True, **FLAGS)(function)  # type: ignore[no-any-return]


def c_function(signature: Any) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function that C code calls through a pointer (its ``.address``), cached on disk."""

    def decorate(function: Callable[..., Any]) -> Any:
        with _own_cache() as cached:
            return numba.cfunc(signature, cache=cached, **FLAGS)(function)

    return decorate
