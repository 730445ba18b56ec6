"""A sweep that is killed at some moment, and whether `--resume` gives the table of one that was not."""

import contextlib
import csv
import os
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

WHO = ("program", "worker", "ngspice")
SCENE = """
[nondimensional]
c1 = -0.5
beta = 0.05
mu = 1.0
D11 = 0.01
"""


def command(folder, points, out):
    """A sweep whose points are quick: half of them in ngspice."""
    scene = Path(folder) / "scene.toml"
    scene.write_text(SCENE)
    engines = ["--engine", "averaged", "--engine", "ensemble", "--engine", "spice"]
    few = ["--trajectories", "2", "--duration", "20", "--dt", "0.2", "--alone", "--workers", "2"]
    vary = ["--vary", f"nondimensional.mu=0.1:10:{points}"]
    return [
        sys.executable,
        "-m",
        "harvester",
        "sweep",
        str(scene),
        *vary,
        *engines,
        *few,
        "--out",
        str(out),
        "--resume",
    ]


def start(arguments):
    """The program in a session of its own, as from a terminal."""
    silent = {
        "stdout": subprocess.DEVNULL,
        "stderr": subprocess.PIPE,
        "text": True,
        "start_new_session": True,
    }
    return subprocess.Popen(arguments, **silent)


def family(pid):
    """Who lives below a process: {"worker": [...], "ngspice": [...]}, without loky's tracker."""
    parents = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            fields = stat.read_text().rpartition(")")[2].split()
            if fields[0] != "Z" and b"tracker" not in stat.with_name("cmdline").read_bytes():
                parents[int(stat.parent.name)] = int(fields[1])
    workers = sorted(p for p, parent in parents.items() if parent == pid)
    return {
        "worker": workers,
        "ngspice": sorted(p for p, parent in parents.items() if parent in workers),
    }


def alive(pid):
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return False


def table(out):
    """sweep.csv without the seconds."""
    with (Path(out) / "sweep.csv").open() as file:
        return [{k: v for k, v in row.items() if k != "seconds"} for row in csv.DictReader(file)]


def rows(out):
    """How many rows are on disk in the journal; None where there is none."""
    path = Path(out) / "sweep.journal"
    try:
        with contextlib.closing(
            sqlite3.connect(f"{path.absolute().as_uri()}?mode=rw", uri=True)
        ) as journal:
            return journal.execute("SELECT count(*) FROM rows").fetchone()[0]
    except sqlite3.OperationalError:  # there is none, or it is just being made
        return None if not path.exists() else 0


def trial(arguments, out, who, least, rng, patience=5.0):
    """Kill ``who`` once, at a random moment after ``least`` rows, then resume: what happened, and the table.

    Raises AssertionError where a process outlives the program, or the program ends otherwise than
    it should.
    """
    program = start(arguments)
    victims = []
    while program.poll() is None and not ((rows(out) or 0) >= least and victims):
        time.sleep(0.02)
        victims = [program.pid] if who == "program" else family(program.pid)[who]
    time.sleep(rng.uniform(0.0, 0.1))
    below = family(program.pid)
    victims = [program.pid] if who == "program" else below[who]
    victim = rng.choice(victims) if victims and program.poll() is None else None
    if victim is not None:
        with contextlib.suppress(ProcessLookupError):
            os.kill(victim, signal.SIGKILL)
    _, said = program.communicate(timeout=600)
    assert program.returncode == (-9 if victim == program.pid else 0), said
    kept = rows(out)
    errors = 0 if kept is not None else sum(bool(row["error"]) for row in table(out))
    end = time.monotonic() + patience
    everyone = [*below["worker"], *below["ngspice"]]
    while any(map(alive, everyone)) and time.monotonic() < end:
        time.sleep(0.05)
    assert [pid for pid in everyone if alive(pid)] == [], "outlived the program"
    again = start(arguments)
    _, said = again.communicate(timeout=600)
    assert again.returncode == 0, said
    found = {
        "who": who,
        "killed": victim is not None,
        "after rows": least,
        "rows then": kept,
        "errors then": errors,
    }
    return found, table(out)
