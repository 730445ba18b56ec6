"""What an accuracy costs without `--engine`: the engine that is taken, and seconds of the processor of all processes.

    python benchmarks/targets.py

Each target is reached with several seeds in one process, after one answer that is not counted: the
start of Python, compilation, and the start of the processes with ngspice are in none of the
seconds.  The median of the seeds counts. Those of ngspice's processes are read from /proc (Linux),
to a hundredth of a second.
"""

import argparse
import contextlib
import os
import resource
import statistics
import time
from pathlib import Path

from common import report

import harvester as hv

EXAMPLES = Path(__file__).parents[1] / "examples"
SCENES = ("paper_figure3", "plate_with_stop", "plate_bridge")
TARGETS = (0.1, 0.03, 0.01, 0.003)


def busy():
    """Processor seconds of this process and of all that it has started, also if they have ended."""
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + ended.ru_utime + ended.ru_stime + children(os.getpid())


def children(pid):
    """Processor seconds of the living processes that a process has started, and of their own."""
    seconds = 0
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        # A thread or a process may end between its listing and its reading.
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            for child in task.read_text().split():
                seconds += of_process(child) + children(child)
    return seconds


def of_process(pid):
    """Processor seconds of a process and of those that it has waited for; 0 if it has ended."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except (FileNotFoundError, ProcessLookupError):
        return 0.0
    return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")


def measured(name, within, seeds):
    """The row of a scene and a target."""
    scene = hv.load(EXAMPLES / f"{name}.toml")
    took = []
    for seed in range(seeds + 1):
        begin = busy()
        found = hv.Cheapest(within=within, seed=seed).run(scene)
        took.append(busy() - begin)
    power = found.mean_power
    row = {
        "scene": name,
        "within": within,
        "engine": found.engine,
        "step": found.details.get("step"),
    }
    return row | {
        "processor s": statistics.median(took[1:]),
        "error": power.known_error95 / power.value,
    }


def main():
    """Measure all and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=5)
    options = parser.parse_args()
    rows = []
    for name in SCENES:
        rows += [measured(name, within, options.seeds) for within in TARGETS]
    report("targets", rows, ("PySpice",), options=vars(options), load=os.getloadavg()[0])


if __name__ == "__main__":
    main()
