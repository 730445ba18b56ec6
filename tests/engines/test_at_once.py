"""All engines at once, in threads and in processes: each answer has the bits that it has alone."""

import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pytest

import harvester as hv
from tests.support.paths import ROOT

THREADS = 4
PROCESSES = 4
LONG_ROUNDS = 2


def runs():
    """Each engine with a short run: a name, and a function of no arguments that computes it."""
    plate = hv.load(ROOT / "examples" / "plate.toml")
    paper = hv.load(ROOT / "examples" / "paper_figure3.toml")
    bridge = hv.load(ROOT / "examples" / "plate_bridge.toml")
    tone = hv.load(ROOT / "examples" / "plate_harmonic.toml")
    short = {"trajectories": 64, "duration": 10.0}
    return {
        "published": partial(hv.run, paper, engine=hv.Published()),
        "averaged": partial(hv.run, paper, engine=hv.Averaged()),
        "exact": partial(hv.run, plate, engine=hv.Exact()),
        "ensemble": partial(hv.run, paper, engine=hv.Ensemble(**short)),
        "ensemble, another seed": partial(hv.run, paper, engine=hv.Ensemble(seed=7, **short)),
        "ensemble, tone": partial(hv.run, tone, engine=hv.Ensemble()),
        "ideal": partial(hv.run, bridge, engine=hv.Ideal(judged=False, **short)),
        "compiled": partial(
            hv.run, tone.with_load(netlist="bridge"), engine=hv.Compiled(judged=False)
        ),
        "spice, tone": partial(hv.run, tone, engine=hv.Spice()),
    }


def bits(run):
    """An answer without its seconds, exact to the last bit."""
    return json.dumps(untimed(run().as_json()), sort_keys=True)


def untimed(answer):
    """An answer without its seconds, at all depths."""
    if isinstance(answer, list):
        return [untimed(part) for part in answer]
    if not isinstance(answer, dict):
        return answer
    return {key: untimed(part) for key, part in answer.items() if not key.endswith("seconds")}


def different(chosen, alone, rounds):
    """Each run of which an answer in a thread differs from the one alone, with both answers."""
    names = list(chosen)
    wrong = {}

    def one_thread(first):
        for k in range(rounds * len(names)):
            # Each thread begins with another engine, and all engines meet one another.
            name = names[(first + k * (first + 1)) % len(names)]
            if (answer := bits(chosen[name])) != alone[name]:
                wrong[name] = (alone[name], answer)

    with ThreadPoolExecutor(THREADS) as pool:
        list(pool.map(one_thread, range(THREADS)))
    return wrong


@pytest.mark.ngspice
@pytest.mark.slow
def test_four_threads_with_all_engines_give_the_bits_of_one():
    """State that two runs share (arrays, caches, options of ngspice) would change an answer here."""
    chosen = runs()
    alone = {name: bits(run) for name, run in chosen.items()}
    assert different(chosen, alone, rounds=1) == {}


@pytest.mark.thorough("test_four_threads_with_all_engines_give_the_bits_of_one")
@pytest.mark.ngspice
@pytest.mark.slow
def test_four_processes_of_four_threads_give_the_bits_of_one(tmp_path):
    """Files that processes share (machine code, solvers, journals of ngspice) would change an answer as well."""
    alone = {name: bits(run) for name, run in runs().items()}
    (tmp_path / "alone.json").write_text(json.dumps(alone))
    command = [sys.executable, "-m", __name__, str(LONG_ROUNDS), str(tmp_path / "alone.json")]
    started = [
        subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        for _ in range(PROCESSES)
    ]
    for process in started:
        printed, _ = process.communicate(timeout=1200)
        assert (process.returncode, printed.decode()) == (0, "{}\n")


if __name__ == "__main__":
    rounds, alone = sys.argv[1:]
    print(different(runs(), json.loads(Path(alone).read_text(encoding="utf-8")), int(rounds)))
