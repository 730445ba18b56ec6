"""Random scenes through every engine: an answer with its errors, or one line, in the time that it was given.

The formulas get scenes of all combinations of effects.  Kernels are compiled for each combination,
some ten seconds each: the other engines get nineteen of twenty scenes around examples, with other
numbers, and the rest of any kind.
"""

import os
import random
import shutil
import tempfile
import time
import tomllib
import warnings
from concurrent.futures import TimeoutError as Late
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from unittest import mock

from attacks.tally import drawn, processor
from hypothesis import strategies as st

from harvester.machine import processes
from harvester.machine.cores import THREADS_VARIABLE
from tests.support import strategies
from tests.support.judge import asked, fault
from tests.support.paths import EXAMPLES

BUDGET = 1.0  # seconds that an engine gets, and its slack: a fifth and 2 s
LATE = 1.2 * BUDGET + 2.0
STARTS = 8.0  # more seconds for `spice`: the start of its processes, which is not in the budget
# wall time after which a scene is given up: what is compiled and not in the budget is well below
PATIENCE = 180.0
FEW = ("--trajectories", "16", "--budget", f"{BUDGET}s")
WITHIN = ("--within", "20%", "--budget", f"{BUDGET}s")
SHORT = ("--trajectories", "2", "--duration", "1", "--budget", f"{BUDGET}s")
WAYS = {  # options of each engine; how often each is asked follows from the number of its lines
    "published": [(), (), (), ()],
    "averaged": [(), (), (), ()],
    "exact": [(), (), (), ()],
    "ensemble": [FEW, WITHIN],
    "ideal": [FEW],
    "spice": [SHORT, (*SHORT, "--alone")],
}
RESISTORS = (
    "paper_figure3",
    "plate",
    "plate_with_stop",
    "plate_harmonic",
    "plate_preloaded",
    "plate_coloured",
)
BRIDGES = ("plate_bridge", "plate_sece")
AROUND = {"ensemble": RESISTORS, "ideal": BRIDGES, "spice": RESISTORS + BRIDGES}


def ask(scene, words):
    """Status, stdout and stderr of a run in the current folder, and the seconds that it took.

    Other work may share the cores, and an engine may use several: the lesser of wall and processor time counts.  One
    ngspice runs at a time: each failure ends all of their processes, and new ones take seconds to start.
    """
    Path("scene.toml").write_bytes(scene)
    warnings.simplefilter("ignore")  # as the program does
    begin = time.monotonic()
    used = processor(os.getpid())
    with mock.patch.dict(os.environ, {THREADS_VARIABLE: "1"} if "spice" in words else {}):
        answer = asked("run", "scene.toml", "--json", *words)
    return answer, min(time.monotonic() - begin, processor(os.getpid()) - used)


def judged(answer, seconds, starts=0.0):
    """What is wrong with an answer of `ask`; ``starts`` is the time of what is not in the budget."""
    return fault(*answer) or (
        f"took {seconds:.1f} s of {BUDGET:g}" if seconds > LATE + starts else ""
    )


def mixed(names):
    """Scenes of any kind; with the names of examples nineteen of twenty around these."""
    if names is None:
        return strategies.scenes
    around = [tomllib.loads((EXAMPLES / f"{name}.toml").read_text()) for name in names]
    return st.integers(0, 19).flatmap(lambda k: strategies.near(around) if k else strategies.scenes)


def plan(numbers, seed):
    """Each number, an engine's name, its options and a scene."""
    ways = [(engine, way) for engine, some in WAYS.items() for way in some]
    kinds = {engine: mixed(AROUND.get(engine)) for engine in WAYS}
    for number in numbers:
        own = f"{seed} {number}"
        engine, way = random.Random(own).choice(ways)
        yield number, engine, way, strategies.written(*drawn(kinds[engine], 1, own))


def attack(tally, seed):
    """Scenes for the tally; each that seems late is asked again, when its kernels are compiled."""
    program = None
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "scene"
        folder.mkdir()
        for record in ("shake.csv", "shake_psd.csv"):
            shutil.copy(EXAMPLES / record, folder)
        shutil.copy(EXAMPLES / "shake.csv", Path(name) / "outside.csv")
        before = {*folder.iterdir(), folder / "scene.toml"}
        for number, engine, way, scene in plan(tally.numbers(), seed):
            program = program or processes.create()
            try:
                for again in (False, True):
                    answer, seconds = program.submit(
                        in_folder, folder, scene, ("--engine", engine, *way)
                    ).result(PATIENCE)
                    wrong = judged(answer, seconds, STARTS if engine == "spice" else 0.0)
                    if again or "took" not in wrong:
                        break
            except (Late, BrokenProcessPool) as error:
                answer = ("none", "", "")
                wrong = f"{type(error).__name__}: it hung or died"
            if {*folder.iterdir()} - before:
                wrong = wrong or f"left {sorted({*folder.iterdir()} - before)}"
            if "hung" in wrong:
                processes.kill(program)
                program = None
            said = {
                "stdout": answer[1][:500],
                "stderr": answer[2][:500],
                "scene": scene.decode(errors="replace")[:3000],
            }
            command = ["run", "scene.toml", "--json", "--engine", engine, *way]
            tally.note(
                engine,
                f"status {answer[0]}",
                wrong,
                seed=seed,
                number=number,
                command=command,
                **said,
            )
        if program is not None:
            processes.kill(program)


def in_folder(folder, scene, words):
    """`ask` in a folder."""
    os.chdir(folder)
    return ask(scene, words)
