"""How this package compiles: decorators over numba with one set of flags and one cache.

numba's own cache looks only at the path and the time of the file of the function that it stores;
here a kernel is made of functions from several files, so the cache folder is named by a hash of
the code in all of them.  A compiled function can also be built again from its source,
interpreted or compiled to exactly the same arithmetic.

Long because all decorators share the flags and the cache.
"""

import hashlib
import inspect
import os
import re
import sys
import threading
import time
import types
from collections import defaultdict
from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba import extending as numba_extending
from numba.core import caching as numba_caching
from numba.core import config as numba_config
from numba.core.dispatcher import Dispatcher
from numba.core.registry import CPUDispatcher

from harvester.machine import folders
from harvester.machine.automatic import is_on_terminal
from harvester.mechanics.kernels import absent_effects, part_libraries, vector_width
from harvester.mechanics.kernels.kernel_cache import FilesOfThisPackage, KeptFiles

config: Any = numba_config
njit: Any = numba.njit
caching: Any = numba_caching
extending: Any = numba_extending
F = TypeVar("F", bound=Callable[..., Any])

# The compiler may contract and reorder, but nan and infinity keep their meaning (no `nnan`,
# no `ninf`): a response that blows up must be seen.
FLAGS: dict[str, Any] = {"fastmath": {"contract", "reassoc", "nsz", "arcp"}, "error_model": "numpy"}
STRICT: dict[str, Any] = {"fastmath": False, "error_model": "numpy"}
VERSIONS: defaultdict[Any, list[Any]] = defaultdict(list)  # kinds of the versions by question
_DECORATING = threading.RLock()
LONGEST_WAIT = 30.0  # s, for a compilation in another process
DECORATED = re.compile(
    rb"^ *(@(kernel|inlined|forced|version_of|otherwise|c_function|intrinsic)\b|class \w+\(NamedTuple\))",
    re.MULTILINE,
)


class Compiler(vector_width.Chosen):
    """The compiler of all kernels: with vectors of the chosen width, and without effects that are absent."""

    library: Any = part_libraries.KernelLibrary

    def define_pipelines(self) -> list[Any]:
        """The passes, and the place of their code."""
        if self.state.library is None:
            self.state.library = self.library(
                self.state.targetctx.codegen(), self.state.func_id.func_qualname
            )
            self.state.library.enable_object_caching()
        return absent_effects.add_to(super().define_pipelines())


class PartCompiler(Compiler):
    """The same for functions of which kernels are made."""

    library = part_libraries.PartLibrary


COMPILER: dict[str, Any] = {"pipeline_class": Compiler}
PART: dict[str, Any] = {
    "pipeline_class": PartCompiler,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}


@cache
def compiled_sources() -> tuple[Path, ...]:
    """The files of this package that machine code is made of: kernels and their arguments, and the compilation."""
    package = Path(__file__).parents[2]
    rooms = ("mechanics", "circuits", "cosimulation")
    files = sorted(file for room in rooms for file in package.glob(f"{room}/**/*.py"))
    return (
        Path(__file__),
        Path(absent_effects.__file__),
        Path(part_libraries.__file__),
        Path(vector_width.__file__),
        *(file for file in files if DECORATED.search(file.read_bytes())),
    )


@cache
def _cache_folder() -> str | None:
    """Folder of the machine code of exactly these sources; None if none can be written."""
    digest = hashlib.sha256()
    for source in compiled_sources():
        digest.update(source.read_bytes())
    base = folders.cache_folder()
    folder = base and folders.private(base / f"kernels-{digest.hexdigest()[:16]}")
    return None if folder is None else str(folder)


def machine_code() -> int:
    """How many files the cache holds for these sources, which are more after a compilation.

    0 without a cache.
    """
    return sum(
        name.endswith(".nbc")
        for *_, names in os.walk(_cache_folder() or os.devnull)
        for name in names
    )


@contextmanager
def own_cache(function: Callable[..., Any]) -> Iterator[bool]:
    """Point numba at the folder of `_cache_folder` while a function is decorated.

    It yields whether there is one, and a file of the function, without which numba keeps nothing.
    """
    folder = _cache_folder()
    _DECORATING.acquire()  # numba's settings are those of all threads
    previous = (config.CACHE_DIR, caching.IndexDataCacheFile)
    file = Path(function.__code__.co_filename)
    ours = file in compiled_sources()
    try:
        config.CACHE_DIR = folder or config.CACHE_DIR
        caching.IndexDataCacheFile = FilesOfThisPackage if ours else KeptFiles
        yield folder is not None and file.is_file()
    finally:
        config.CACHE_DIR, caching.IndexDataCacheFile = previous
        _DECORATING.release()


@dataclass
class Compilation:
    """Seconds that the first call of a kernel lasted: long once for each set of effects, then read from the cache."""

    seconds: float = 0.0


@contextmanager
def compilation() -> Iterator[Compilation]:
    """Time the first call of a kernel; on a terminal, name the work if it lasts long."""
    took = Compilation()
    begin = time.perf_counter()
    notice = threading.Timer(0.5, _print_notice)
    notice.daemon = True
    notice.start()
    try:
        yield took
    finally:
        notice.cancel()
        took.seconds = time.perf_counter() - begin


def _print_notice() -> None:
    if is_on_terminal():
        print(
            "compiling the kernel for this scene's effects: some seconds, once; it is cached",
            file=sys.stderr,
        )


class _Part(CPUDispatcher):
    """A function compiled into kernels only: without the wrappers for calls from Python and C, a quarter of the time.

    A call from Python, as of a test, uses a compilation of its own.
    """

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """The function's result."""
        return _alone(self)(*arguments, **named)


@cache
def _alone(part: _Part) -> Any:
    """A part compiled to be called from Python."""
    return (
        _cached(part.py_func)
        if part.targetoptions["fastmath"]
        else njit(**COMPILER, **STRICT)(part.py_func)
    )


def _part(function: F, flags: dict[str, Any] = FLAGS, **options: Any) -> F:
    """Compile a function as a part of kernels."""
    made = njit(**options, **PART, **flags)(function)
    made.__class__ = _Part
    return made  # type: ignore[no-any-return]


def inlined(function: F) -> F:
    """Compile a small function that a kernel calls; LLVM inlines it."""
    return _part(function)


def forced(function: F) -> F:
    """Compile a function that is inlined into its kernel whatever its size.

    A call that is left cannot become vector instructions, and counts references to its arrays with
    atomic operations: up to twenty times slower.
    """
    return _part(function, forceinline=True)


def version_of(question: Callable[..., Any], **kinds: type | None) -> Callable[[F], F]:
    """Make a function the version of a ``question`` for arguments of these kinds.

    A kernel that asks the question is compiled with it. A kind is a NamedTuple of ours, or None for
    all else, such as an absent argument; an argument without a kind may be of any, and the version
    with most kinds holds. The parameters have the names of those of the question.
    """

    def registered(function: F) -> F:
        signature = inspect.signature(function)

        def chosen(*given: Any, **named: Any) -> Any:
            of = signature.bind(*given, **named).arguments
            classes = {name: getattr(kind, "instance_class", None) for name, kind in of.items()}
            fitting = [known for known in VERSIONS[question] if known.items() <= classes.items()]
            return function if kinds == max(fitting, key=len, default=None) else None

        chosen.__signature__ = signature  # type: ignore[attr-defined]
        VERSIONS[question].append(kinds)
        extending.overload(question, jit_options={"forceinline": True, **PART, **FLAGS})(chosen)
        return function

    return registered


def otherwise(question: F) -> F:
    """Make a question its own answer for arguments of which it has no version."""
    return version_of(question)(question)


class _Kernel(CPUDispatcher):
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


def kernel(function: F) -> F:
    """Compile a function called from Python, whose result has no NamedTuple, as `_cached`."""
    made = _cached(function)
    made.__class__ = _Kernel
    return made  # type: ignore[no-any-return]


def _cached(function: Callable[..., Any]) -> Any:
    """Compile a function: cached on disk, free of the interpreter's lock."""
    with own_cache(function) as cached:
        return njit(cache=cached, nogil=True, no_cfunc_wrapper=True, **COMPILER, **FLAGS)(function)


def c_function(signature: Any, later: bool = False) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function that C code calls through a pointer (its ``.address``), cached on disk.

    ``later`` leaves that to the first who asks for the address.
    """

    def compiled(function: Callable[..., Any]) -> Any:
        with own_cache(function) as cached:
            return numba.cfunc(signature, cache=cached, **COMPILER, **FLAGS)(function)

    return partial(LaterFunction, compiled) if later else compiled


class LaterFunction:
    """A C function that is compiled when its address is first asked for.

    ``elsewhere`` is a job of another process that compiles it meanwhile, for the cache that both
    share.
    """

    def __init__(
        self, compiled: Callable[[Callable[..., Any]], Any], function: Callable[..., Any]
    ) -> None:
        self.function = function
        self.compiled = compiled
        self._lock = threading.Lock()
        self._address = 0
        self.elsewhere = Future[Any]()
        self.elsewhere.set_result(None)

    @property
    def is_cached(self) -> bool:
        """Whether the cache has it."""
        name = f"{Path(self.function.__code__.co_filename).stem}.{self.function.__qualname__}-*.nbc"
        return any(Path(_cache_folder() or os.devnull).rglob(name))

    @property
    def waits(self) -> bool:
        """Whether another process is still at it."""
        return not (self._address or self.elsewhere.done() or self.is_cached)

    @property
    def address(self) -> int:
        """The address, which threads ask for side by side and one makes."""
        with self._lock:
            if not self._address:
                # where it fails there, it is compiled here
                wait([self.elsewhere] * self.waits, LONGEST_WAIT)
                self._address = int(self.compiled(self.function).address)
            return self._address


@cache
def interpreted(function: Any) -> Any:
    """A compiled function, and those that it calls, as plain Python."""
    return _rebuilt(function, interpreted)


@cache
def strict(function: Any) -> Any:
    """A compiled function, and those that it calls, compiled as written: no reordered sums, no fused multiply-add.

    It rounds as Python does, so that a path of ngspice, whose iterations amplify a last digit to its
    tolerance, is the same to all digits with compiled and with interpreted callbacks.  It is a part of C functions.
    """
    return _part(_rebuilt(function, strict), STRICT)


def _rebuilt(function: Any, rebuild: Callable[[Any], Any]) -> types.FunctionType:
    """The Python function of a compiled one, in which ``rebuild`` has replaced the compiled functions that it calls."""
    plain = function.py_func
    names = plain.__globals__
    called = {
        name: names[name]
        for name in plain.__code__.co_names
        if isinstance(names.get(name), Dispatcher)
    }
    replaced = {**names, **{name: rebuild(inner) for name, inner in called.items()}}
    return types.FunctionType(
        plain.__code__, replaced, plain.__name__, plain.__defaults__, plain.__closure__
    )
