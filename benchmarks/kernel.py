"""What a step of the ensemble's kernel costs on one core: with vectors of 256 and of 512 bits, and with controls.

    python benchmarks/kernel.py

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
    else:
        main()
