"""Random netlists through ngspice: a number or one line; strace shows each file that is opened, each program started.

Seven of eight are random text like a netlist's; the others are the package's with a random line in
them, most of which ngspice gets to see.  Fifty go through one traced program, which opens a mark
between them.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from attacks.scenes import STARTS, ask, judged
from attacks.tally import drawn
from hypothesis import strategies as st

from harvester.machine import folders
from harvester.netlists.load_circuit import netlist_folder
from tests.support import strategies
from tests.support.opened import opened, strange, traced
from tests.support.paths import ROOT

PROGRAMS = [Path(sys.executable), Path("/sbin/ldconfig")]  # that ctypes asks where a library is
SETTINGS = [Path("/etc/ld.so.cache"), Path("/etc/localtime")]  # all that a run reads of /etc
TOGETHER = 50  # netlists of one traced program
PATIENCE = 60.0  # seconds of each
WORDS = (
    "--engine",
    "spice",
    "--alone",
    "--trajectories",
    "2",
    "--duration",
    "0.5",
    "--dt",
    "0.01",
    "--budget",
    "1s",
)
SCENE = """
[oscillator]
mass = "40 g"
stiffness = "16 N/m"
damping_ratio = 0.05
[piezo]
coupling = "1e-3 N/V"
capacitance = "40 nF"
[excitation]
acceleration_psd = "1e-3 m^2/s^3"
[load]
netlist = "./mine.cir"
parameters = {R = 1e5}
"""


@st.composite
def netlists(draw):
    """A netlist of `strategies.netlists`, or one of the package's with a line of such a one."""
    text = draw(strategies.netlists())
    if draw(st.integers(0, 7)):
        return text
    name = draw(st.sampled_from([one for one in strategies.NETLISTS if one != "resistor"]))
    lines = (netlist_folder() / f"{name}.cir").read_bytes().splitlines()
    lines.insert(
        draw(st.integers(2, len(lines))), draw(st.sampled_from(text.splitlines() or [b""]))
    )
    return b"\n".join(lines) + b"\n"


def attack(tally, seed):
    """Netlists for the tally."""
    texts = drawn(netlists(), tally.count, seed)
    with tempfile.TemporaryDirectory() as name:
        for first in tally.numbers(TOGETHER):
            some = texts[first : first + TOGETHER]
            for number, (outcome, wrong) in enumerate(
                together(Path(name) / f"{first}", some), first
            ):
                text = texts[number].decode(errors="replace")
                tally.note("netlist", outcome, wrong, seed=seed, number=number, netlist=text)


def together(folder, texts):
    """(How it ended, what is wrong) of each netlist in one traced program."""
    (folder / "scene").mkdir(parents=True)
    (folder / "outside.cir").write_text("* nobody asked for this\n")
    drawn_here = [folder / f"{k}.cir" for k in range(len(texts))]
    for path, text in zip(drawn_here, texts, strict=True):
        path.write_bytes(text)
    where = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "benchmarks")])}
    trace, driver = (
        folder / "trace",
        [sys.executable, "-m", "attacks.netlists", *map(str, drawn_here)],
    )
    try:
        streams = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "text": True}
        line, most = [*traced(trace), *driver], PATIENCE * len(texts)
        done = subprocess.run(
            line, cwd=folder / "scene", env=where, check=False, timeout=most, **streams
        )
        said = done.stdout.splitlines()
    except subprocess.TimeoutExpired as late:
        said = (late.stdout or b"").decode().splitlines()
    answers = [(f"status {status}", wrong) for status, wrong in map(json.loads, said)]
    answers += [("none", "it hung or died")] * (len(texts) - len(answers))
    for number, wrong in touched(trace, folder):
        answers[number] = answers[number][0], answers[number][1] or wrong
    if left := {path.name for path in (folder / "scene").iterdir()} - {"scene.toml", "mine.cir"}:
        answers[-1] = answers[-1][0], answers[-1][1] or f"left by one of these: {sorted(left)}"
    return answers


def touched(trace, folder):
    """(Number of the netlist, what is wrong) of each file that a netlist has no business with."""
    number = None
    here = folder / "scene"
    for path, line in opened(trace, here) if trace.exists() else ():
        if path.parent == folder and path.stem.isdecimal():
            number = int(path.stem)
        elif number is not None and "O_DIRECTORY" not in line:  # folders of modules are listed
            if "execve(" in line:
                wrong = path not in PROGRAMS
            elif re.search(r"O_(WRONLY|RDWR|CREAT)", line):
                wrong = not any(
                    path.is_relative_to(place) for place in (here, "/dev", folders.cache_folder())
                )
            else:
                wrong = strange(path, [here]) or (
                    path.is_relative_to("/etc") and path not in SETTINGS
                )
            if wrong:
                yield number, f"opened {path}: {line[:200]}"


def driver(paths):
    """Ask for the power with each netlist in the current folder; print the status and what is wrong, one line each."""
    for path in paths:
        Path("mine.cir").write_bytes(Path(path).read_bytes())
        answer, seconds = ask(SCENE.encode(), WORDS)
        wrong = judged(answer, seconds, STARTS)
        print(json.dumps((answer[0], wrong and f"{wrong}: {answer}")), flush=True)


if __name__ == "__main__":
    driver(sys.argv[1:])
