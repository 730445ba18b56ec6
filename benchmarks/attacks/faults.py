"""Faults of the machine in every command: its words, its remains, and whether a sweep continues from there.

Each trial starts a program in a session and a folder of its own.  What a signal kills without
warning, or a library aborts in too little memory, is counted apart: no program can promise anything
then but whole files and no processes.
"""

import os
import random
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import kills
from attacks.shim import built
from attacks.tally import living
from attacks.wholeness import unwhole, wrong_words

from tests.support.paths import EXAMPLES, ROOT

PATIENCE = 150.0  # wall time (s) of a program
PLATE, DRIVEN = str(EXAMPLES / "plate_with_stop.toml"), str(EXAMPLES / "plate_harmonic.toml")
SHORT = "--trajectories 2 --duration 5 --alone"
DEVICE = "--mass 40g --frequency 3.2Hz --q 100 --capacitance 40nF --coupling '1e-3 N/V' --resistance 1Mohm"
LINES = {
    "keys": "keys --json",
    "doctor": "doctor",
    "new": f"new out/mine.toml {DEVICE} --acceleration-psd '1e-5 g^2/Hz' --json",
    "run averaged": f"run {PLATE} --engine averaged --json --report out/report.html",
    "run ensemble": f"run {PLATE} --engine ensemble --json --trajectories 512",
    "run spice": f"run {PLATE} --engine spice --json {SHORT}",
    "sweep": f"sweep {PLATE} --vary load.resistance=1k:10M:60 --engine averaged --workers 2 --out out",
    "sweep spice": f"sweep {PLATE} --vary load.resistance=100k:1M:6 --engine spice {SHORT} --workers 2 --out out",
    "compare": f"compare {PLATE} --json --out out --budget 2s",
    "cost": f"cost {PLATE} --out out --budget 2s",
    "optimise": f"optimise {PLATE} --vary load.resistance=1k:10M --engine averaged --json --out out",
    "motion": f"motion {PLATE} --engine spice --duration 2 --out out",
    "response": f"response {DRIVEN} --sweep 3Hz:4Hz:5 --json --out out",
    "stability": f"stability {PLATE} --json --trajectories 64",
    "paper": "paper --out out",
}
COMMANDS = {name: shlex.split(line) for name, line in LINES.items()}
PROGRAM = [sys.executable, "-m", "harvester"]
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL, signal.SIGHUP)
WRITING = [
    name for name, words in COMMANDS.items() if any(word.startswith("out") for word in words)
]
TELLING = [name for name in COMMANDS if name != "paper"]


def attack(tally, seed):
    """Faults for the tally: two of five are signals."""
    with tempfile.TemporaryDirectory() as name:
        shim = built(Path(name))
        expected = undisturbed(Path(name) / "whole")
        for number in tally.numbers():
            folder = Path(name) / f"{number}"
            for inner in ("tmp", "out"):
                (folder / inner).mkdir(parents=True)
            rng = random.Random(f"{seed} {number}")
            kind = (signals, signals, full_disk, limits, rng.choice([caches, clocks]))[number % 5]
            what, command, how = kind(rng, folder, shim)
            outcome, wrong, said = trial(folder, command, how)
            if (
                not wrong
                and command.startswith("sweep")
                and (folder / "out").is_dir()
                and kind in (signals, full_disk)
            ):
                wrong = resumed(folder, command, expected)
            tally.note(
                what,
                outcome,
                wrong,
                seed=seed,
                number=number,
                command=COMMANDS[command],
                fault=str(how),
                said=said,
            )
            shutil.rmtree(folder, ignore_errors=True)


def undisturbed(folder):
    """The tables of the sweeps that nothing disturbs."""
    tables = {}
    for command in ("sweep", "sweep spice"):
        folder.mkdir(exist_ok=True)
        subprocess.run(
            [*PROGRAM, *COMMANDS[command]],
            cwd=folder,
            check=True,
            capture_output=True,
            env=environment(folder),
        )
        tables[command] = kills.table(folder / "out")
        shutil.rmtree(folder)
    return tables


def environment(folder, **more):
    """The variables of a program: its temporary files are in the folder."""
    return {**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(folder / "tmp"), **more}


def trial(folder, command, how):
    """Run a command with a fault: (how it ended, what is wrong, what it said)."""
    limit, strike, moment, more, stdout = (
        how.get(key) for key in ("limit", "signal", "moment", "env", "stdout")
    )
    with (folder / "stdout").open("w") as kept, Path(stdout or folder / "stdout").open("w") as out:
        line = [*(["prlimit", limit] if limit else ()), *PROGRAM, *COMMANDS[command]]
        env = environment(folder, **(more or {}))
        streams = {"stdout": out, "stderr": subprocess.PIPE, "text": True}
        program = subprocess.Popen(line, cwd=folder, env=env, start_new_session=True, **streams)
        kept.flush()
        if strike is not None:
            time.sleep(moment)
            if program.poll() is None:
                (os.killpg if strike == signal.SIGINT else os.kill)(program.pid, strike)
        try:
            err = program.communicate(timeout=PATIENCE)[1]
            late = ""
        except subprocess.TimeoutExpired:
            os.killpg(program.pid, signal.SIGKILL)
            err = program.communicate()[1]
            late = f"no end after {PATIENCE:g} s"
    said = {"stdout": (folder / "stdout").read_text(errors="replace")[-500:], "stderr": err[-1500:]}
    wrong = (
        late or outlived(program.pid) or wrong_words(program.returncode, said["stdout"], err, how)
    )
    return f"status {program.returncode}", wrong or unwhole(folder, program.returncode), said


def outlived(session, patience=6.0):
    """Which processes of a session still live a little later; they are ended then."""
    end = time.monotonic() + patience
    while left := [pid for pid, (_, its, _) in living().items() if its == session]:
        if time.monotonic() > end:
            names = [
                Path(f"/proc/{pid}/cmdline").read_text().replace("\0", " ")[:150] for pid in left
            ]
            os.killpg(session, signal.SIGKILL)
            return f"outlived the program: {names}"
        time.sleep(0.1)
    return ""


def resumed(folder, command, expected):
    """What is wrong with the table after --resume."""
    done = subprocess.run(
        [*PROGRAM, *COMMANDS[command], "--resume"],
        cwd=folder,
        env=environment(folder),
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE,
    )
    if done.returncode:
        return f"--resume: status {done.returncode}: {done.stderr}"
    return (
        "" if kills.table(folder / "out") == expected[command] else "--resume gives another table"
    )


def signals(rng, folder, shim):
    """A signal at a random moment; ^C goes to the whole session, as a terminal's does."""
    one = rng.choice(SIGNALS)
    return one.name, rng.choice(list(COMMANDS)), {"signal": one, "moment": rng.uniform(0.0, 6.0)}


def full_disk(rng, folder, shim):
    """No file may grow beyond a size, the disk as a whole is full after some bytes or slow, or stdout's is full."""
    how = rng.choice(["a file", "the disk", "stdout", "slow"])
    if how == "slow":
        return (
            "slow disk",
            rng.choice(WRITING),
            {"env": {"LD_PRELOAD": shim, "DELAY": f"{rng.randrange(20, 200)}"}},
        )
    if how == "stdout":
        return "full disk", rng.choice(TELLING), {"stdout": "/dev/full"}
    room = int(10.0 ** rng.uniform(0.0, 5.5))
    faults = (
        {"limit": f"--fsize={room}"}
        if how == "a file"
        else {"env": {"LD_PRELOAD": shim, "ROOM": f"{room}"}}
    )
    return "full disk", rng.choice([name for name in WRITING if name != "paper"]), faults


def limits(rng, folder, shim):
    """Little memory, few descriptors, or few threads and processes."""
    if rng.random() < 0.3:
        return (
            "threads",
            rng.choice(TELLING),
            {"env": {"LD_PRELOAD": shim, "THREADS": f"{rng.randrange(12)}"}},
        )
    if rng.random() < 0.5:
        room = int(rng.uniform(0.5e9, 3e9))
        return "memory", rng.choice(TELLING), {"limit": f"--as={room}", "memory": True}
    return "descriptors", rng.choice(TELLING), {"limit": f"--nofile={rng.randrange(8, 60)}"}


def caches(rng, folder, shim):
    """A cache that cannot be written, is a file, is others' too, or has been cut off in the middle of a file."""
    way = rng.choice(["none", "file", "others", "cut"])
    cache = folder / "tmp" / "cache"
    if way == "file":
        cache.touch()
    elif way == "others":
        cache.mkdir()
        cache.chmod(0o777)
    elif way == "cut":
        from harvester.machine.folders import cache_folder

        shutil.copytree(cache_folder(), cache)
        for path in cache.glob("kernels-*/*/*.nb?"):
            if rng.random() < 0.5:
                os.truncate(path, rng.randrange(path.stat().st_size))
    else:
        cache = Path("/proc/nobody/cache")
    return (
        f"cache {way}",
        rng.choice(["new", "run averaged", "run ensemble", "run spice", "sweep"]),
        {"env": {"NUMBA_CACHE_DIR": str(cache)}},
    )


def clocks(rng, folder, shim):
    """The clock of the day jumps once, by up to ten years, at a random look."""
    jump = {
        "LOOKS": f"{rng.randrange(1, 2000)}",
        "JUMP": f"{rng.randrange(-315_000_000, 315_000_000)}",
    }
    return "clock", rng.choice(TELLING), {"env": {"LD_PRELOAD": shim, **jump}}
