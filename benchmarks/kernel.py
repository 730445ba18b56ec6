"""What a step of the ensemble's kernel costs on one core: with vectors of 256 and of 512 bits, and with controls.

    python benchmarks/kernel.py
    python benchmarks/kernel.py --counts     the same step among 4,096 and 65,536 trajectories; writes nothing

Processes with either width run in turn, several rounds, one thread each; the smallest processor
time of a step counts. 512 bits are what the package takes where its own trial finds them faster
(harvester/mechanics/kernels/vector_width.py); 256 bits are asked for by NUMBA_CPU_NAME, as a user
can.  On a processor without AVX-512 both are the same.
"""

import json
import os
import subprocess
import sys
import time

import llvmlite.binding as llvm
import numpy as np
from common import report
from controls import SCENES, circuits

from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.vector_width import faster, width

ROUNDS = 4
H = 0.1
COUNT = 1024
WARM = 20.0
DURATION = 400.0
TAKEN = ("paper, r = .96", "no stop", "gap .5", "two stops", "coloured, stop")
CIRCUITS = ("bridge, no stop", "bridge, stop")
FEW, MANY = 4096, 65_536  # trajectories, whose states fit in the cache, and do not
IN_TURN = 5  # rounds


def timed():
    """Nanoseconds of a step by scene, plain and with controls, in this process."""
    found = {name: (SCENES[name], None) for name in TAKEN}
    found |= {name: (eqs, circuit) for name, eqs, circuit in circuits() if name in CIRCUITS}
    costs = {}
    for name, (eqs, circuit) in found.items():
        for controlled in (False, True):
            many = Trajectories(
                eqs, COUNT, np.random.SeedSequence(1), H, circuit=circuit, controlled=controlled
            )
            many.run(WARM)  # compiles
            before = many.steps
            begin = time.process_time()
            many.run(DURATION)
            costs[f"{name}{', controls' if controlled else ''}"] = (
                1e9 * (time.process_time() - begin) / (many.steps - before)
            )
    return {"bits": width(), "costs": costs}


def by_count():
    """Print million steps per second of few and many trajectories, in turn in this process, and the ratios of costs."""
    os.environ["HARVESTER_THREADS"] = "1"
    for name in TAKEN[:3]:
        runs = {}
        for controlled in (False, True):
            for count in (FEW, MANY):
                runs[controlled, count] = Trajectories(
                    SCENES[name], count, np.random.SeedSequence(1), H, controlled=controlled
                )
                runs[controlled, count].run(WARM)  # compiles
        least = dict.fromkeys(runs, float("inf"))
        for _ in range(IN_TURN):
            for kind, many in runs.items():
                before = many.steps
                begin = time.process_time()
                for _ in range(MANY // many.count):
                    many.run(DURATION)
                cost = 1e9 * (time.process_time() - begin) / (many.steps - before)
                least[kind] = min(cost, least[kind])
        for controlled in (False, True):
            few = least[controlled, FEW]
            many_cost = least[controlled, MANY]
            print(
                f"{name}{', controls' if controlled else ''}: {1e3 / few:.0f} and {1e3 / many_cost:.0f} "
                f"million steps per second, {MANY}:{FEW} {many_cost / few:.3f}, "
                f"controls:plain {few / least[False, FEW]:.2f}"
            )


def main():
    """Run the rounds and keep the table."""
    environment = dict(os.environ, HARVESTER_THREADS="1")
    kinds = {
        "default": environment,
        "256": environment | {"NUMBA_CPU_NAME": llvm.get_host_cpu_name()},
    }
    least, bits = {}, {}
    for _ in range(ROUNDS):
        for kind, variables in kinds.items():
            command = [sys.executable, __file__, "--timed"]
            done = json.loads(
                subprocess.run(
                    command, env=variables, check=True, capture_output=True, text=True
                ).stdout
            )
            bits[kind] = done["bits"]
            for name, cost in done["costs"].items():
                least[name, kind] = min(cost, least.get((name, kind), float("inf")))
    rows = [
        {
            "scene": name,
            "ns a step, 256 bits": least[name, "256"],
            "ns a step": least[name, "default"],
            "million steps a second": 1e3 / least[name, "default"],
            "times faster": least[name, "256"] / least[name, "default"],
        }
        for name in dict.fromkeys(name for name, _ in least)
    ]
    report("kernel", rows, ("numba", "llvmlite"), bits=bits["default"], trial=faster())


if __name__ == "__main__":
    if "--timed" in sys.argv:
        print(json.dumps(timed()))
    elif "--counts" in sys.argv:
        by_count()
    else:
        main()
