"""Generated solvers in the cache: cut off, altered, exchanged, asked for by many, or not kept."""

import ctypes
import importlib.util
import os
import resource
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from numba.core import caching, config

from harvester.circuits import newton
from harvester.mechanics.kernels.compiled import kernel, own_cache

SOLVER = """
from numba import float64

from harvester.mechanics.kernels.compiled import c_function


@c_function(float64(float64))
def solve(x):
    return {factor} * x
"""


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty folder for machine code and for sources."""
    folder = tmp_path / "cache"
    folder.mkdir()
    monkeypatch.setattr("harvester.mechanics.kernels.compiled._cache_folder", lambda: str(folder))
    return folder


def value(factor=2.0):
    """What a solver gives of 3, loaded as in a new process."""
    address = newton.compiled_source.__wrapped__(SOLVER.format(factor=factor)).address
    return ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(address)(3.0)


def bytecode_of(source):
    """The file of Python's own bytecode of a source, with another solver in it."""
    path = Path(importlib.util.cache_from_source(str(source)))
    path.parent.mkdir(exist_ok=True)
    state = source.stat()
    from importlib import _bootstrap_external

    other = compile(SOLVER.format(factor=5.0), str(source), "exec")
    path.write_bytes(
        _bootstrap_external._code_to_timestamp_pyc(other, int(state.st_mtime), state.st_size)
    )
    return path


@pytest.mark.parametrize("damage", ["other", "cut"])
def test_bytecode_beside_a_source_is_not_read(cache, damage):
    """With the source's time and size in its head it was run; cut off, it ended each later run.

    That run stated "marshal data too short", with the status of an interrupt.
    """
    assert value() == 6.0
    (source,) = cache.glob("circuit_*.py")
    bytecode = bytecode_of(source)
    if damage == "cut":
        os.truncate(bytecode, 40)
    for code in cache.rglob("*.nbc"):  # so that the function is compiled anew, from what is read
        code.unlink()
    assert value() == 6.0


@pytest.mark.parametrize("text", ["", "solve = 1", SOLVER.format(factor=7.0), "\0" * 100])
def test_a_source_that_was_altered_is_made_anew(cache, text):
    """Cut off to nothing, another text, another solver of the same length, a worn disk's zeros."""
    assert value() == 6.0
    (source,) = cache.glob("circuit_*.py")
    whole = source.read_text()
    source.write_text(text)
    assert value() == 6.0
    assert source.read_text() == whole


@pytest.mark.parametrize("instead", ["folder", "link", "pipe"])
def test_what_stands_in_the_place_of_a_source(cache, instead, tmp_path):
    """A folder, a link and a pipe stop no run, and the link's file stays as it was."""
    assert value() == 6.0
    (source,) = cache.glob("circuit_*.py")
    source.unlink()
    other = tmp_path / "other.py"
    other.write_text("solve = 1\n")
    match instead:
        case "folder":
            source.mkdir()
        case "link":
            source.symlink_to(other)
        case _:
            os.mkfifo(source)
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(value).result(timeout=120) == 6.0
    assert other.read_text() == "solve = 1\n"


def test_machine_code_of_another_solver_is_not_run(cache):
    """Exchanged files are whole, each with its checksum, but are those of other functions."""
    assert (value(2.0), value(4.0)) == (6.0, 12.0)
    first, second = cache.rglob("*.nbc")
    content = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(content)
    assert (value(2.0), value(4.0)) == (6.0, 12.0)


def test_machine_code_of_another_kernel_is_not_run(cache):
    def double(x):
        return 2.0 * x

    def triple(x):
        return 3.0 * x

    assert (kernel(double)(1.0), kernel(triple)(1.0)) == (2.0, 3.0)
    first, second = cache.rglob("*.nbc")
    content = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(content)
    assert (kernel(double)(1.0), kernel(triple)(1.0)) == (2.0, 3.0)


def test_a_disk_that_takes_no_source(cache):
    """In a read-only folder or on a full disk the solver is made for this process alone."""

    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, limits[1]))
    try:
        assert value() == 6.0
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert not [path for path in cache.rglob("*.nbc") if path.stat().st_size]


@pytest.mark.slow
def test_many_processes_make_one_solver_at_once(tmp_path):
    """Eight programs begin with an empty cache: each has the right solver, and one file is kept."""

    code = f"import sys; sys.path[:0] = {sys.path!r}\n" + (
        "import ctypes\n"
        "from harvester.circuits import newton\n"
        f"solve = newton.compiled_source({SOLVER.format(factor=2.0)!r})\n"
        "print(ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(solve.address)(3.0))\n"
    )
    env = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    call = [sys.executable, "-c", code]
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    programs = [subprocess.Popen(call, env=env, cwd=tmp_path, **streams) for _ in range(8)]
    assert [one.communicate(timeout=120) for one in programs] == [("6.0\n", "")] * 8
    (source,) = (tmp_path / "cache").rglob("circuit_*.py")
    assert source.read_text() == SOLVER.format(factor=2.0)


def test_threads_that_decorate_at_once_leave_numba_as_it_was(cache):
    """One put back what another had set: other functions were then kept in this cache."""
    before = config.CACHE_DIR, caching.IndexDataCacheFile

    def decorate(turn):
        for k in range(turn, turn + 50):
            with own_cache(value):
                time.sleep(1e-4 * (1 + k % 3))

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(decorate, range(8)))
    assert (config.CACHE_DIR, caching.IndexDataCacheFile) == before
