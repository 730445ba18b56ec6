"""A sweep with a figure, processes, kernels and ngspice, from a folder full of traps: nothing in it is read or run.

A `.spiceinit` in the user's home is not read either.
"""

import importlib.metadata
import os
import re
import subprocess
import sys
from pathlib import Path

import matplotlib
import pytest

from harvester.machine import folders
from tests.support.judge import complaints
from tests.support.opened import STRACE, opened, strange, traced
from tests.support.paths import EXAMPLES, ROOT

pytestmark = [pytest.mark.thorough("test_folders.py"), pytest.mark.ngspice, pytest.mark.slow]

PLATE = str(EXAMPLES / "plate_bridge.toml")
SWEEP = [
    "sweep",
    PLATE,
    "--vary",
    "load.parameters.R=1M,2M",
    "--engine",
    "spice",
    "--alone",
    "--workers",
    "2",
]
SWEEP += ["--trajectories", "2", "--duration", "5", "--dt", "0.01", "--seed", "1", "--out"]
SETTINGS = {
    ".spiceinit": "shell touch {ran}\nset interp\n",
    "spice.rc": "shell touch {ran}\n",
    ".numba_config.yaml": "cache_dir: {ran}\ndisable_jit: 1\n",
    "matplotlibrc": "font.size: 30\nsavefig.dpi: 20\nlines.marker: o\naxes.facecolor: red\nnonsense\n",
}


def traps(folder, ran):
    """Fill a folder with every module of Python and of what is installed, each of which notes that it ran.

    But for those that Python itself imports from there, before the first line of `python -m
    harvester`.
    """
    folder.mkdir()
    own = subprocess.check_output(
        [sys.executable, "-Pc", "import runpy, sys; print(*sys.modules)"], text=True
    ).split()
    for name in {
        *sys.stdlib_module_names,
        *importlib.metadata.packages_distributions(),
        "usercustomize",
    }:
        if name not in {*own, "harvester"} and name.isidentifier():
            (folder / f"{name}.py").write_text(f"open({str(ran)!r}, 'a').write({name + ' '!r})\n")
    for name, text in SETTINGS.items():
        (folder / name).write_text(text.format(ran=ran))
    return folder


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """The test's folder: `traps` was the current folder, `ran` notes what ran there, `trace` holds the files opened.

    `home` was the home, `ran_at_home` notes what ran there; the caches are where they always are.
    """
    path = tmp_path_factory.mktemp("stranger")
    command = [*traced(path / "trace"), sys.executable, "-m", "harvester", *SWEEP, path / "out"]
    env = {
        **os.environ,
        "PYTHONPATH": str(ROOT),
        "PYTHONDONTWRITEBYTECODE": "1",
        "HOME": str(path / "home"),
    }
    env |= {
        folders.VARIABLE: str(folders.cache_folder()),
        "MPLCONFIGDIR": matplotlib.get_cachedir(),
    }
    (path / "home").mkdir()
    (path / "home" / ".spiceinit").write_text(SETTINGS["spice.rc"].format(ran=path / "ran_at_home"))
    where = traps(path / "traps", path / "ran")
    done = subprocess.run(
        command, cwd=where, env=env, capture_output=True, text=True, check=False, timeout=300
    )
    assert (done.returncode, complaints(done.stderr)) == (0, "")
    return path


def test_nothing_in_the_folder_runs(swept):
    assert not (swept / "ran").exists(), (swept / "ran").read_text()
    assert len(list((swept / "traps").iterdir())) > 300


def test_no_spiceinit_in_the_home_runs(swept):
    assert not (swept / "ran_at_home").exists()


def test_nothing_in_the_folder_changes_an_answer(swept, harvester):
    """The same powers, and the same figure to a byte, as from another folder."""
    assert harvester(*SWEEP, swept / "clean")[0] == 0
    assert (swept / "out" / "sweep.png").read_bytes() == (
        swept / "clean" / "sweep.png"
    ).read_bytes()
    power = re.compile(r"spice,([^,]+),([^,]+)")
    first, second = (
        power.findall((swept / name / "sweep.csv").read_text()) for name in ("out", "clean")
    )
    assert first == second
    assert len(first) == 2


@pytest.mark.skipif(
    STRACE is None, reason="strace, which tells the files that a program opens, is not installed"
)
def test_files_that_are_opened(swept):
    """Those of the scene's folder, the output's, Python and its packages, the cache, the system's, no others."""
    found = {one for one, _ in opened(swept / "trace", swept / "traps")}
    assert len(found) > 500
    unknown = {one for one in found if strange(one, [swept / "out"])}
    # a folder to come back to, folders of modules
    assert unknown - {swept / "traps", *map(Path, sys.path)} == set()
