"""A sweep that is killed at some moment, and whether `--resume` gives the table of one that was not.

    python benchmarks/kills.py              each command that writes, killed three times

strikes the other commands as well, and looks for files that are cut off and processes that are left.
"""

import argparse
import contextlib
import csv
import os
import random
import re
import shlex
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from attacks.wholeness import cut_off

EXAMPLES = Path(__file__).parents[1] / "examples"
WRITING = {
    "report": "run {examples}/plate.toml --engine averaged --report out/r.html",
    "export": "export {examples}/plate.toml --out out/e.lib",
    "record": "record {examples}/shake.csv --out out/clean.csv",
    "adopt": "adopt out/deck.net --out out/board.cir",
    "new": "new out/n.toml --mass 40g --frequency 3.2Hz --q 100 --capacitance 40nF "
    "--coupling '1e-3 N/V' --resistance 1Mohm --acceleration-psd '1e-5 g^2/Hz'",
    "identify": "identify {examples}/bench_impedance.csv --out out/i.toml",
    "tolerance": "tolerance {examples}/plate.toml --engine averaged --vary load.resistance=10% "
    "--out out",
    "optimise": "optimise {examples}/plate.toml --engine averaged --vary "
    "load.resistance=1k:10M --out out",
    "sweep": "sweep {examples}/plate.toml --engine averaged --vary load.resistance=1k:10M:30 "
    "--workers 2 --out out",
    "compare": "compare {examples}/plate.toml --budget 2s --out out",
    "motion": "motion {examples}/plate.toml --duration 2 --out out",
    "response": "response {examples}/plate_harmonic.toml --sweep 3Hz:4Hz:5 --out out",
    "charge": "charge {examples}/bimorph_ltc3588.toml --to 3V --engine slow --out out",
    "node": "node {examples}/bimorph_chip.toml --report out/r.html",
    "paper": "paper 1 --out out",
}

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


def strike(name, folder, rng):
    """Start a command that writes, and kill it: at a random moment, or as soon as it makes a file.

    Returns what is wrong: a file that is cut off under its own name, or a process that is left; and
    whether the command had ended before.
    """
    words = shlex.split(WRITING[name].format(examples=EXAMPLES))
    out = Path(folder) / "out"
    out.mkdir(parents=True)
    shutil.copy(EXAMPLES / "deck.net", out)
    program = subprocess.Popen(
        [sys.executable, "-P", "-m", "harvester", *words],
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=os.environ | {"TMPDIR": str(out)},
        start_new_session=True,
    )
    at_file = rng.random() < 0.7
    end = time.monotonic() + (120.0 if at_file else rng.uniform(0.5, 6.0))
    while program.poll() is None and time.monotonic() < end:
        if at_file and sum(one.is_file() for one in out.rglob("*")) > 1:
            time.sleep(rng.choice([0.0, 0.003, 0.03]))
            break
        time.sleep(0.0005)
    below = family(program.pid)
    ended = program.poll() is not None
    program.kill()
    program.wait()
    assert program.returncode in (0, -signal.SIGKILL), f"{name} has status {program.returncode}"
    everyone = [*below["worker"], *below["ngspice"]]
    end = time.monotonic() + 5.0
    while any(map(alive, everyone)) and time.monotonic() < end:
        time.sleep(0.05)
    left = [f"process {pid} is left" for pid in everyone if alive(pid)]
    names = [one for one in out.rglob("*") if not one.name.startswith(".")]
    return left + [
        f"{one.name} is cut off" for one in names if one.is_file() and cut_off(one)
    ], ended


def main():
    """Each command that writes is killed a few times: how often, and what was wrong."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--times", type=int, default=3)
    parser.add_argument("--seed", type=int, default=61)
    parser.add_argument("--only", default="", help="regular expression of the commands")
    options = parser.parse_args()
    rng = random.Random(options.seed)
    for name in filter(re.compile(options.only).search, WRITING):
        wrong = []
        ended = 0
        for _ in range(options.times):
            with tempfile.TemporaryDirectory() as folder:
                (found, before) = strike(name, folder, rng)
            wrong += found
            ended += before
        print(
            f"{name:<10} {options.times} kills, {ended} after its end: {wrong or 'nothing'}",
            flush=True,
        )


if __name__ == "__main__":
    main()
