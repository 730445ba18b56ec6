"""The wheel of packaging/ngspice, built once a machine and recipe, and programs that have its ngspice and no other."""

import hashlib
import os
import subprocess
import sys
import tomllib
import zipfile
from functools import cache
from pathlib import Path

import pytest

from harvester.machine.folders import cache_folder
from harvester.machine.locks import alone
from tests.support.paths import ROOT

FOLDER = ROOT / "packaging/ngspice"
LONGEST = 3000  # seconds of a build on a machine that does other things too


def _recipe_hash():
    files = sorted(path for path in FOLDER.rglob("*") if path.suffix in (".py", ".toml"))
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()[:12]


@cache
def wheel():
    """The path of the wheel; a test is skipped where the index or the source of ngspice is not to be had."""
    made = (
        cache_folder() or pytest.skip("there is no cache for the wheel")
    ) / f"ngspice-wheel-{_recipe_hash()}"
    made.mkdir(exist_ok=True)
    with alone(made / "lock"):
        if not (found := list(made.glob("*.whl"))):
            _build(made)
            found = list(made.glob("*.whl"))
    return found[0]


def _build(made):
    """Build it by the commands of its README, in an environment of its own."""
    environment = made / "environment"
    python = environment / "bin/python"
    subprocess.run([sys.executable, "-m", "venv", environment], check=True, timeout=300)
    needs = tomllib.loads((FOLDER / "pyproject.toml").read_text())["build-system"]["requires"]
    got = subprocess.run(
        [python, "-m", "pip", "install", "-q", *needs, "auditwheel"],
        check=False,
        capture_output=True,
    )
    if got.returncode:
        pytest.skip("the package index, which has the compiler, is not reached")
    code = "import sys; from pathlib import Path; from recipe import source; print(source.archive(Path(sys.argv[1])))"
    got = subprocess.run(
        [python, "-c", code, made], cwd=FOLDER, check=False, capture_output=True, text=True
    )
    if got.returncode:
        pytest.skip(f"the source of ngspice is not to be had: {got.stderr.splitlines()[-1]}")
    command = [
        python,
        "-m",
        "pip",
        "wheel",
        "-q",
        "--no-deps",
        "--no-build-isolation",
        "-w",
        made,
        FOLDER,
    ]
    env = {**os.environ, "NGSPICE_SOURCE": got.stdout.strip(), "NGSPICE_BUILD": str(made / "build")}
    done = subprocess.run(
        command, env=env, check=False, capture_output=True, text=True, timeout=LONGEST
    )
    assert done.returncode == 0, done.stdout + done.stderr


def audited():
    """What auditwheel states of the wheel."""
    command = [wheel().parent / "environment/bin/auditwheel", "show", wheel()]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def installed(folder):
    """A folder for PYTHONPATH that has the wheel's content."""
    with zipfile.ZipFile(wheel()) as archive:
        archive.extractall(folder)
    return Path(folder)


def bare_environment(home, *paths):
    """The environment of a user with an empty home, a path without programs, and packages in folders."""
    path = os.pathsep.join(str(one) for one in (*paths, ROOT))
    return {
        "HOME": str(home),
        "PATH": "/nonexistent",
        "PYTHONPATH": path,
        "XDG_CACHE_HOME": str(home / "cache"),
    }
