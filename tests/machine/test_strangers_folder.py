"""A sweep with a figure, processes, kernels and ngspice, from a folder full of traps: nothing in it is read or run."""

import importlib.metadata
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from collections import defaultdict
from pathlib import Path

import matplotlib
import pytest

from harvester.machine import folders
from tests.support.paths import EXAMPLES, ROOT

pytestmark = [pytest.mark.ngspice, pytest.mark.slow]

PLATE = str(EXAMPLES / "plate_bridge.toml")
SWEEP = ["sweep", PLATE, "--vary", "load.parameters.R=1M,2M", "--engine", "spice", "--alone", "--workers", "2"]
SWEEP += ["--trajectories", "2", "--duration", "5", "--dt", "0.01", "--seed", "1", "--out"]
STRACE = shutil.which("strace")
SETTINGS = {
    ".spiceinit": "shell touch {ran}\nset interp\n",
    "spice.rc": "shell touch {ran}\n",
    ".numba_config.yaml": "cache_dir: {ran}\ndisable_jit: 1\n",
    "matplotlibrc": "font.size: 30\nsavefig.dpi: 20\nlines.marker: o\naxes.facecolor: red\nnonsense\n",
}


def traps(folder, ran):
    """Fill a folder with every module of Python and of what is installed, each of which notes that it ran.

    But for those that Python itself takes from there, before the first line of `python -m harvester`.
    """
    folder.mkdir()
    own = subprocess.check_output([sys.executable, "-Pc", "import runpy, sys; print(*sys.modules)"], text=True).split()
    for name in {*sys.stdlib_module_names, *importlib.metadata.packages_distributions(), "usercustomize"}:
        if name not in {*own, "harvester"} and name.isidentifier():
            (folder / f"{name}.py").write_text(f"open({str(ran)!r}, 'a').write({name + ' '!r})\n")
    for name, text in SETTINGS.items():
        (folder / name).write_text(text.format(ran=ran))
    return folder


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """The test's folder: `traps` was the current folder, `ran` notes what ran there, `trace` holds the files opened."""
    path = tmp_path_factory.mktemp("stranger")
    trace = [
        STRACE,
        "-f",
        "--seccomp-bpf",
        "-z",
        "-e",
        "open,openat,execve,chdir,fchdir",
        "-s",
        "300",
        "-o",
        path / "trace",
    ]
    command = [*(trace if STRACE else ()), sys.executable, "-m", "harvester", *SWEEP, path / "out"]
    env = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"}
    where = traps(path / "traps", path / "ran")
    done = subprocess.run(command, cwd=where, env=env, capture_output=True, text=True, check=False, timeout=300)
    assert (done.returncode, done.stderr) == (0, "")
    return path


def test_nothing_in_the_folder_runs(swept):
    assert not (swept / "ran").exists(), (swept / "ran").read_text()
    assert len(list((swept / "traps").iterdir())) > 300


def test_nothing_in_the_folder_changes_an_answer(swept, harvester):
    """The same powers, and the same figure to a byte, as from another folder."""
    assert harvester(*SWEEP, swept / "clean")[0] == 0
    assert (swept / "out" / "sweep.png").read_bytes() == (swept / "clean" / "sweep.png").read_bytes()
    power = re.compile(r"spice,([^,]+),([^,]+)")
    first, second = (power.findall((swept / name / "sweep.csv").read_text()) for name in ("out", "clean"))
    assert first == second
    assert len(first) == 2


@pytest.mark.skipif(STRACE is None, reason="strace, which tells the files that a program opens, is not installed")
def test_files_that_are_opened(swept):
    """Those of the scene's folder, the output's, Python and its packages, the cache, the system's, no others."""
    found, current = [], defaultdict(lambda: [swept / "traps"])  # the folders of each process
    for line in (swept / "trace").read_text().splitlines():
        folder = current[line.split()[0]]
        if call := re.match(r'\d+\s+(chdir|open|openat|execve)\((?:AT_FDCWD, )?"([^"]*)"', line):
            (folder if call[1] == "chdir" else found).append(Path(os.path.normpath(folder[-1] / call[2])))
        elif "fchdir(" in line:
            folder.pop()
    assert len(found) > 1000
    own = {swept / "out", EXAMPLES, ROOT / "harvester", ROOT / "netlists", folders.cache_folder()}
    own |= {Path(sys.prefix), Path(sys.base_prefix), *map(Path, sysconfig.get_paths().values())}
    system = {Path(one) for one in ("/usr", "/lib", "/lib64", "/bin", "/sbin", "/etc", "/proc", "/sys", "/dev")}
    fonts = {Path(matplotlib.get_configdir()), Path(matplotlib.get_cachedir())}
    strange = {one for one in found if not any(one.is_relative_to(place) for place in own | system | fonts)}
    assert strange - {swept / "traps", *map(Path, sys.path)} == set()  # a folder to come back to, folders of modules
