"""Ends of a sweep: kills, ^C, a full disk, a closed pipe.  `--resume` gives the table of an undisturbed run."""

import importlib
import os
import random
import resource
import signal
import subprocess
import sys
import time

import pytest

from tests.support.judge import complaints
from tests.support.paths import ROOT

pytestmark = [
    pytest.mark.thorough("nothing: programs are killed, disks are full"),
    pytest.mark.ngspice,
    pytest.mark.slow,
]

sys.path.append(str(ROOT / "benchmarks"))
kills = importlib.import_module("kills")

PLATE = str(ROOT / "examples" / "plate.toml")
# of three rows; two ends of the program leave the last ones undone, on a busy machine and a quick
# one
POINTS = 24


def until(condition, seconds=60.0):
    """Whether a condition became true in time."""
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)
    return condition()


def rows(out):
    """How many rows the journal has, 0 where there is none."""
    return kills.rows(out) or 0


def finished(harvester, command):
    """Whether the sweep, in this process, comes to its end without a word."""
    words = command[command.index("harvester") + 1 :]
    words[words.index("--workers") + 1] = "1"
    status, _, said = harvester(*words)
    return (status, complaints(said)) == (0, "")


def test_kills_and_resumes(tmp_path, harvester):
    """A worker and then the program are killed, on resuming an ngspice, and then ^C from the terminal reaches all."""
    rng = random.Random(3)
    out = tmp_path / "out"
    whole = tmp_path / "whole"
    assert finished(harvester, kills.command(tmp_path, POINTS, whole))
    expected = kills.table(whole)
    assert [row["error"] for row in expected] == [""] * 3 * POINTS

    def struck(who, then, status):
        program = kills.start(kills.command(tmp_path, POINTS, out))
        least = rows(out) + rng.randrange(2, 6)
        assert until(lambda: rows(out) >= least and kills.family(program.pid)[who]), program.poll()
        os.kill(rng.choice(kills.family(program.pid)[who]), signal.SIGKILL)
        after = rows(out) + rng.randrange(1, 4)
        assert until(lambda: rows(out) >= after and len(kills.family(program.pid)["worker"]) == 2)
        everyone = [pid for pids in kills.family(program.pid).values() for pid in pids]
        kept = rows(out)
        then(program)
        said = complaints(program.communicate(timeout=60)[1])
        assert program.returncode == status
        assert until(lambda: not any(map(kills.alive, everyone)), 5.0), "outlived the program"
        assert rows(out) >= kept
        return said

    assert struck("worker", lambda program: program.kill(), -signal.SIGKILL) == ""
    said = struck("ngspice", lambda program: os.killpg(program.pid, signal.SIGINT), 130).strip()
    assert said.startswith("harvester: interrupted: ")
    assert said.endswith(
        f" of {3 * POINTS} rows are in '{out}'; the same command with --resume continues from there"
    )
    assert "\n" not in said
    assert finished(harvester, kills.command(tmp_path, POINTS, out))
    assert kills.table(out) == expected
    assert {p.name for p in out.iterdir()} == {
        "sweep.csv",
        "sweep.nc",
        "sweep.png",
        "provenance.json",
    }


QUICK = [
    "sweep",
    PLATE,
    "--engine",
    "averaged",
    "--vary",
    "load.resistance=1k:10M:600",
    "--workers",
    "1",
    "--out",
]


def program(*arguments, **options):
    line = [sys.executable, "-m", "harvester", *map(str, arguments)]
    return subprocess.run(line, capture_output=True, text=True, check=False, timeout=60, **options)


def test_a_full_disk(tmp_path, harvester):
    """No file may be larger than so many bytes: one line, whole rows; with room again the sweep continues."""

    def little():
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))

    done = program(*QUICK, tmp_path, preexec_fn=little)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        "harvester: --out must accept sweep.journal, but writing failed: disk I/O error (ulimit -f?); the points that "
        "are done are kept for --resume\n"
    )
    assert {p.name for p in tmp_path.iterdir()} == {"sweep.csv", "sweep.journal", "provenance.json"}
    kept = kills.rows(tmp_path)
    assert kept % 256 == 0
    assert 0 < kept < 600
    assert len(kills.table(tmp_path)) == kept
    before = (tmp_path / "sweep.csv").read_text()
    assert harvester(*QUICK, str(tmp_path), "--resume")[0] == 0
    assert (tmp_path / "sweep.csv").read_text().startswith(before)  # the seconds, too
    assert len(kills.table(tmp_path)) == 600


def test_a_closed_pipe(tmp_path):
    line = f"{sys.executable} -m harvester {' '.join(QUICK)} {tmp_path} | head -1; echo ${{PIPESTATUS[0]}}"
    done = subprocess.run(
        ["bash", "-c", line], capture_output=True, text=True, timeout=60, check=True
    )
    assert (done.stdout.split()[-1], done.stderr) == ("0", "")
    assert len(kills.table(tmp_path)) == 600


def test_memory_is_flat():
    """Memory of the program, from the 2,000th to the 5,000th point of a sweep; they fail at once, and are rows."""
    code = f"""
import os, tempfile
from pathlib import Path
import harvester as hv
from harvester.studies.sweep.points import read_axis
from harvester.machine.progress import CallingBack
from harvester.errors import CannotServeError
memory = []
def tick(done, what):
    memory.append(0)
    if len(memory) in (2000, 5000):
        memory[-1] = int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
scene = hv.load({PLATE!r}).with_load(hv.Load(netlist="bridge"))
axis = read_axis("load.parameters.R=1k:1M:5000")
try:
    execution = hv.Execution(out=tempfile.mkdtemp(), progress=CallingBack(tick), workers=1)
    hv.sweep(scene, vary=[axis], engines=[hv.Ensemble()], execution=execution)
except CannotServeError:
    print(len(memory), memory[4999] - memory[1999])
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    points, grown = map(int, done.stdout.split())
    assert points == 5_000
    assert grown < 7e5
