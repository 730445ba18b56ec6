"""Compilation is timed, and told to whoever waits for it at a terminal; what it makes is kept in files."""

import ast
import os
import shutil
import subprocess
import sys
import time

import pytest

from harvester.mechanics.kernels.compiled import compilation, compiled_sources, kernel
from tests.support.paths import ROOT

# A small kernel of the package; the file that was imported is that of the copy.
CALL = """
import sys, numpy as np, harvester
from harvester.mechanics.kernels.noise import fill_three_point
assert harvester.__file__.startswith(sys.argv[1])
fill_three_point(np.empty(8), np.uint64(1), np.uint64(2))
"""


@pytest.mark.parametrize("terminal", [True, False])
@pytest.mark.parametrize("seconds", [0.0, 0.7])
def test_a_long_first_call_is_told_on_a_terminal(capsys, monkeypatch, terminal, seconds):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: terminal, raising=False)
    with compilation() as took:
        time.sleep(seconds)
    assert took.seconds == pytest.approx(seconds, abs=0.2)
    assert ("compiling" in capsys.readouterr().err) == (terminal and seconds > 0.5)


@pytest.mark.parametrize("room", [0, 20, -1], ids=["empty", "begun", "nearly whole"])
def test_files_that_are_cut_off_are_made_anew(tmp_path, monkeypatch, room):
    """As after a crash of the machine; they were an internal error."""
    monkeypatch.setattr("harvester.mechanics.kernels.compiled._cache_folder", lambda: str(tmp_path))

    def twice(x):
        return 2.0 * x

    assert kernel(twice)(1.0) == 2.0
    for suffix in ("nbi", "nbc"):
        (file,) = tmp_path.rglob(f"*.{suffix}")
        whole = file.stat().st_size
        os.truncate(file, room % whole)
        assert kernel(twice)(2.0) == 4.0
        assert file.stat().st_size == whole


def test_constants_of_machine_code_are_in_its_cache_s_name():
    """No compiled file takes a constant from one that the name of the cache is no hash of."""
    files = {".".join(file.relative_to(ROOT).with_suffix("").parts) for file in compiled_sources()}
    assert "harvester.mechanics.kernels.lanes" in files
    assert "harvester.mechanics.ensemble.trajectories" not in files
    for file in compiled_sources():
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module.startswith("harvester") and node.module not in files:
                assert [one.name for one in node.names if one.name.isupper()] == [], file


def test_machine_code_does_not_depend_on_where_its_source_lies(tmp_path):
    """A copy of the package compiles nothing that the same sources compiled elsewhere, at another time."""
    found = []
    for place in ("here", "there"):
        shutil.copytree(
            ROOT / "harvester", tmp_path / place / "harvester", ignore=shutil.ignore_patterns("__pycache__")
        )
        env = os.environ | {"PYTHONPATH": str(tmp_path / place), "XDG_CACHE_HOME": str(tmp_path / "cache")}
        subprocess.run(
            [sys.executable, "-c", CALL, str(tmp_path / place)], env=env, cwd=tmp_path, check=True, timeout=60
        )
        found.append({file.name: file.stat().st_mtime_ns for file in (tmp_path / "cache").rglob("*.nbc")})
    assert found[0] == found[1] != {}
