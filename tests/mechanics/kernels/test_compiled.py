"""Compilation is timed, and reported to whoever waits for it at a terminal; what it makes is kept in files."""

import ast
import fcntl
import math
import os
import resource
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from harvester.mechanics.kernels.compiled import compilation, compiled_sources, inlined, kernel
from harvester.mechanics.kernels.equation_of_motion import carried, decayed
from tests.support.paths import ROOT

# A small kernel of the package; the file that was imported is that of the copy.
CALL = """
import sys, numpy as np, harvester
from harvester.mechanics.kernels.noise import fill_three_point
assert harvester.__file__.startswith(sys.argv[1])
fill_three_point(np.empty(8), np.uint64(1), np.uint64(2))
print(sum(fill_three_point.stats.cache_misses.values()))
"""


@pytest.mark.slow
@pytest.mark.parametrize("terminal", [True, False])
@pytest.mark.parametrize("seconds", [0.0, 0.7])
def test_a_long_first_call_is_told_on_a_terminal(capsys, monkeypatch, terminal, seconds):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: terminal, raising=False)
    with compilation() as took:
        time.sleep(seconds)
    assert took.seconds == pytest.approx(seconds, abs=0.2)
    assert ("compiling" in capsys.readouterr().err) == (terminal and seconds > 0.5)


def test_a_part_of_kernels_can_be_called_from_python():
    """Compiled without what that needs, it would end the program: the call falls back to a compilation of its own."""
    for times in (1, 2):
        assert decayed(0.3 * times) == pytest.approx(-math.expm1(-0.3 * times))
    assert carried(0.4, way=0.1, t=0.0, mu=2.0) == pytest.approx(0.5)


def test_a_part_has_no_machine_code_and_its_error_reaches_the_kernel(cache):
    """The values in an error's text are objects of Python, which the kernel gets from the part."""

    @inlined
    def at_most_one(x):
        if x > 1.0:
            raise ValueError("too large", x)
        return x

    @kernel
    def twice(x):
        return 2.0 * at_most_one(x)

    assert twice(0.5) == 1.0
    (made,) = at_most_one.overloads.values()
    assert made.library.get_pointer_to_function(made.fndesc.llvm_func_name) == 0
    with pytest.raises(ValueError, match="too large") as told:
        twice(1.5)
    assert told.value.args == ("too large", 1.5)


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty folder for machine code."""
    monkeypatch.setattr(
        "harvester.mechanics.kernels.compiled._cache_folder", lambda: str(tmp_path / "cache")
    )
    return tmp_path / "cache"


@pytest.mark.parametrize("room", [0, 20, -1], ids=["empty", "begun", "nearly whole"])
def test_files_that_are_cut_off_are_made_anew(cache, room):
    """As after a crash of the machine; they were an internal error."""

    def twice(x):
        return 2.0 * x

    assert kernel(twice)(1.0) == 2.0
    (file,) = cache.rglob("*.nbc")
    whole = file.stat().st_size
    os.truncate(file, room % whole)
    assert kernel(twice)(2.0) == 4.0
    assert file.stat().st_size >= whole  # names of functions have running numbers


@pytest.mark.parametrize("place", [0.0, 0.02, 0.3, 0.6, 0.999])
def test_a_bit_that_has_flipped_makes_a_file_absent(cache, place):
    """It was unpickled, and its machine code run: errors of LLVM, or a program that ends without a word."""

    def thrice(x):
        return 3.0 * x

    assert kernel(thrice)(1.0) == 3.0
    (file,) = cache.rglob("*.nbc")
    content = bytearray(file.read_bytes())
    content[int(place * len(content))] ^= 0b100
    file.write_bytes(content)
    again = kernel(thrice)
    assert again(2.0) == 6.0
    assert sum(again.stats.cache_misses.values()) == 1
    third = kernel(thrice)
    assert third(2.0) == 6.0
    assert sum(third.stats.cache_misses.values()) == 0


def test_a_disk_that_takes_nothing_stops_no_kernel(cache):
    """No file may grow: each process compiles for itself, and nothing half written stays."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)

    def fourfold(x):
        return 4.0 * x

    resource.setrlimit(resource.RLIMIT_FSIZE, (0, limits[1]))
    try:
        assert kernel(fourfold)(1.0) == 4.0
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert all(one.stat().st_size == 0 for one in cache.rglob("*") if one.is_file())
    assert not list(cache.rglob("*.nbc"))


def test_constants_of_machine_code_are_in_its_cache_s_name():
    """No compiled file takes a constant from one that the name of the cache is not a hash of."""
    files = {".".join(file.relative_to(ROOT).with_suffix("").parts) for file in compiled_sources()}
    assert "harvester.mechanics.kernels.trajectory_batch" in files
    assert "harvester.mechanics.ensemble.trajectories" not in files
    for file in compiled_sources():
        for node in ast.walk(ast.parse(file.read_text())):
            if (
                isinstance(node, ast.ImportFrom)
                and node.module.startswith("harvester")
                and node.module not in files
            ):
                assert [one.name for one in node.names if one.name.isupper()] == [], file


@pytest.mark.slow
def test_machine_code_does_not_depend_on_where_its_source_lies(tmp_path):
    """Among two copies of the package that begin at once one compiles, and the other reads what that one has kept."""
    both = []
    for place in ("here", "there"):
        shutil.copytree(
            ROOT / "harvester",
            tmp_path / place / "harvester",
            ignore=shutil.ignore_patterns("__pycache__"),
        )
        env = os.environ | {
            "PYTHONPATH": str(tmp_path / place),
            "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
        }
        call = [sys.executable, "-c", CALL, str(tmp_path / place)]
        both.append(
            subprocess.Popen(call, env=env, cwd=tmp_path, stdout=subprocess.PIPE, text=True)
        )
    assert sorted(one.communicate(timeout=60)[0].strip() for one in both) == ["0", "1"]
    (kept,) = (tmp_path / "cache").rglob("*.nbc")
    assert "fill_three_point" in kept.name


def test_a_kernel_waits_for_the_process_that_compiles_it(cache, monkeypatch):
    """And reads what that one has kept; it does not wait for ever for one that was stopped."""

    def half(x):
        return 0.5 * x

    assert kernel(half)(1.0) == 0.5
    (kept,), (turn,) = (list(cache.rglob(f"*{end}")) for end in (".nbc", ".turn-*"))
    same = kernel(half)
    hidden = kept.with_suffix(".hidden")
    with ThreadPoolExecutor(1) as pool, turn.open("ab") as of_turn:
        fcntl.flock(of_turn, fcntl.LOCK_EX)
        kept.rename(hidden)
        waiting = pool.submit(same, 2.0)
        with pytest.raises(TimeoutError):
            waiting.result(timeout=0.5)
        hidden.rename(kept)
        fcntl.flock(of_turn, fcntl.LOCK_UN)
        assert waiting.result(timeout=60) == 1.0
        assert sum(same.stats.cache_misses.values()) == 0
        fcntl.flock(of_turn, fcntl.LOCK_EX)
        kept.unlink()
        monkeypatch.setattr("harvester.machine.locks.LONGEST_TURN", 0.1)
        assert kernel(half)(3.0) == 1.5


def test_a_pipe_in_the_place_of_a_lock(cache):
    """It has no writer and would be waited for without end."""

    def fifth(x):
        return 0.2 * x

    assert kernel(fifth)(1.0) == 0.2
    (kept,), (turn,) = (list(cache.rglob(f"*{end}")) for end in (".nbc", ".turn-*"))
    kept.unlink()
    turn.unlink()
    os.mkfifo(turn)
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(kernel(fifth), 2.0).result(timeout=60) == 0.4
