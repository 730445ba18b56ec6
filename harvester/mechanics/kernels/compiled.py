"""How this package compiles: decorators over numba with one set of flags and one cache.

numba's own cache looks only at the path and the time of the file of the function that it stores; here a kernel is made
of functions from several files, so the cache folder is named by a hash of what stands in all of them, wherever they
lie and whenever they were written.  A compiled function can also be built again from its source, interpreted or
compiled to exactly the same arithmetic.
"""

import hashlib
import pickle
import re
import sys
import threading
import time
import types
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core import caching as numba_caching
from numba.core import config as numba_config
from numba.core.dispatcher import Dispatcher

from harvester.machine import folders

config: Any = numba_config
caching: Any = numba_caching
F = TypeVar("F", bound=Callable[..., Any])

# The compiler may contract and reorder, but nan and infinity keep their meaning (no `nnan`,
# no `ninf`): a response that blows up must be seen.
FLAGS: dict[str, Any] = {"fastmath": {"contract", "reassoc", "nsz", "arcp"}, "error_model": "numpy"}


DECORATED = re.compile(rb"^ *@(kernel|inlined|forced|c_function)\b", re.MULTILINE)


@cache
def compiled_sources() -> tuple[Path, ...]:
    """The files of this package that machine code is made of: those with a decorator of this module, and this one."""
    package = Path(__file__).parents[2]
    files = sorted([*package.glob("mechanics/**/*.py"), *package.glob("circuit/**/*.py")])
    return (Path(__file__), *(file for file in files if DECORATED.search(file.read_bytes())))


@cache
def _cache_folder() -> str | None:
    """Folder of the machine code of exactly these sources; None where none can be written."""
    digest = hashlib.sha256()
    for source in compiled_sources():
        digest.update(source.read_bytes())
    base = folders.cache_folder()
    folder = base and folders.own(base / f"kernels-{digest.hexdigest()[:16]}")
    return None if folder is None else str(folder)


class _Files(numba_caching.IndexDataCacheFile):
    """The files of a cached function, where one that is cut off, as by a crash of the machine, counts as absent."""

    def _load_index(self) -> Any:
        try:
            return super()._load_index()
        except (pickle.UnpicklingError, EOFError):
            return {}

    def _load_data(self, name: str) -> Any:
        try:
            return super()._load_data(name)
        except (pickle.UnpicklingError, EOFError):
            raise FileNotFoundError(name) from None  # which numba expects


class _FilesOfThisPackage(_Files):
    """The same, of a function whose source the folder's name is a hash of: its path and its time do not matter."""

    def __init__(self, cache_path: str, filename_base: str, source_stamp: Any) -> None:
        room = Path(cache_path)
        room = room.with_name(room.name.rsplit("_", 1)[0])  # numba appends a hash of the source's path
        room.mkdir(parents=True, exist_ok=True)
        super().__init__(str(room), filename_base, None)


@contextmanager
def _own_cache(function: Callable[..., Any]) -> Iterator[bool]:
    """Point numba at the folder of `_cache_folder` while a function is decorated; yields whether there is one."""
    folder, previous = _cache_folder(), (config.CACHE_DIR, caching.IndexDataCacheFile)
    ours = Path(function.__code__.co_filename) in compiled_sources()
    config.CACHE_DIR = folder or config.CACHE_DIR
    caching.IndexDataCacheFile = _FilesOfThisPackage if ours else _Files
    try:
        yield folder is not None
    finally:
        config.CACHE_DIR, caching.IndexDataCacheFile = previous


@dataclass
class Compilation:
    """Seconds that the first call of a kernel took: long once for each set of effects, then read from the cache."""

    seconds: float = 0.0


@contextmanager
def compilation() -> Iterator[Compilation]:
    """Time the first call of a kernel; on a terminal, say what is going on if it takes long."""
    took, begin = Compilation(), time.perf_counter()
    notice = threading.Timer(0.5, _print_notice)
    notice.daemon = True
    notice.start()
    try:
        yield took
    finally:
        notice.cancel()
        took.seconds = time.perf_counter() - begin


def _print_notice() -> None:
    if sys.stderr.isatty():
        print("compiling the kernel for this scene's effects: some seconds, once; it is cached", file=sys.stderr)


def inlined(function: F) -> F:
    """Compile a small function that a kernel calls; LLVM inlines it."""
    return numba.njit(**FLAGS)(function)  # type: ignore[no-any-return]


def forced(function: F) -> F:
    """Compile a function that is inlined into its kernel whatever its size.

    A call that is left cannot become vector instructions, and counts references to its arrays with atomic operations:
    up to twenty times slower.
    """
    return numba.njit(forceinline=True, **FLAGS)(function)  # type: ignore[no-any-return]


def kernel(function: F) -> F:
    """Compile a function called from Python: cached on disk, free of the interpreter's lock."""
    with _own_cache(function) as cached:
        return numba.njit(cache=cached, nogil=True, **FLAGS)(function)  # type: ignore[no-any-return]


def c_function(signature: Any) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function that C code calls through a pointer (its ``.address``), cached on disk."""

    def decorate(function: Callable[..., Any]) -> Any:
        with _own_cache(function) as cached:
            return numba.cfunc(signature, cache=cached, **FLAGS)(function)

    return decorate


@cache
def interpreted(function: Any) -> Any:
    """A compiled function, and those that it calls, as plain Python."""
    return _rebuilt(function, interpreted)


@cache
def strict(function: Any) -> Any:
    """A compiled function, and those that it calls, compiled as written: no reordered sums, no fused multiply-add.

    It rounds as Python does, so that a path of ngspice, whose iterations amplify a last digit to its
    tolerance, is the same to all digits with compiled and with interpreted callbacks.
    """
    return numba.njit(error_model="numpy", fastmath=False)(_rebuilt(function, strict))


def _rebuilt(function: Any, rebuild: Callable[[Any], Any]) -> types.FunctionType:
    """The Python function of a compiled one, in which ``rebuild`` has replaced the compiled functions that it calls."""
    plain = function.py_func
    names = plain.__globals__
    called = {name: names[name] for name in plain.__code__.co_names if isinstance(names.get(name), Dispatcher)}
    replaced = {**names, **{name: rebuild(inner) for name, inner in called.items()}}
    return types.FunctionType(plain.__code__, replaced, plain.__name__, plain.__defaults__, plain.__closure__)
