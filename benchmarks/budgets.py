"""What `--budget` asks for and what commands take: twenty scenes and commands, seconds of wall and of processor.

Each is run as a program of its own.  Compilation is not in the budget: each runs once before it
counts, with a tenth of the budget.  ``allowed`` is the budget with 20 % and two seconds more,
``held`` whether the wall's seconds are within it.  Where the machine has other work (``load``), the
seconds of all its processes together (``busy``), over the cores, are what a quiet one would take at
least; ``quietly`` says whether these are within it.

    .venv/bin/python benchmarks/budgets.py --budget 6
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from common import report

CORES = os.cpu_count() or 1
EXAMPLES = Path(__file__).parents[1] / "examples"
CASES = {  # words after `harvester`; a name without a dot is an example
    "plate, ensemble": "run plate --engine ensemble --within 0.01%",
    "stop, ensemble": "run plate_with_stop --engine ensemble --within 0.01%",
    "stop, spice": "run plate_with_stop --engine spice --within 0.1%",
    "bistable": "run plate_bistable --engine ensemble --within 0.01%",
    "two stops": "run plate_two_stops --engine ensemble --within 0.01%",
    "compliant stop": "run plate_compliant_stop --engine ensemble --within 0.1%",
    "preloaded": "run plate_preloaded --engine ensemble --within 0.01%",
    "coloured": "run plate_coloured --engine ensemble --within 0.1%",
    "recorded": "run plate_recorded --engine ensemble --within 0.1%",
    "weak coupling": "run plate_weak --engine ensemble --within 0.01%",
    "bridge, ideal": "run plate_bridge --engine ideal --within 0.01%",
    "bridge, spice": "run plate_bridge --engine spice --within 0.1%",
    "doubler, spice": "run plate_doubler --engine spice --within 0.1%",
    "parallel SSHI, spice": "run plate_parallel_sshi --engine spice --within 1%",
    "series SSHI, spice": "run plate_series_sshi --engine spice --within 1%",
    "SECE, spice": "run plate_sece --engine spice --within 1%",
    "paper, no target": "run paper_figure3 --engine ensemble",
    "harmonic with a stop": "run plate_harmonic_stop --engine ensemble --within 0.1%",
    "compare": "compare plate_with_stop",
    "optimise": "optimise plate_with_stop --vary load.resistance=100k:10M --engine ensemble --within 0.1%",
}


def words(case, budget):
    """The command of a case."""
    parts = [
        str(EXAMPLES / f"{part}.toml") if (EXAMPLES / f"{part}.toml").exists() else part
        for part in case.split()
    ]
    return [sys.executable, "-m", "harvester", *parts, "--budget", f"{budget:g}s"]


def taken(command, folder, limit):
    """Seconds of wall and of all its processes, exit status, and the last line that it said."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begin = time.perf_counter()
    try:
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, timeout=limit, check=False
        )
        status = done.returncode
        said = (done.stderr or done.stdout).strip().splitlines()[-1:]
    except subprocess.TimeoutExpired:
        status = None
        said = [f"stopped by the benchmark after {limit:g} s"]
    wall = time.perf_counter() - begin
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    busy = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return wall, busy, status, " ".join(said)[:160]


def main():
    """Run every case and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("case", nargs="*", help="names of cases; default: all")
    parser.add_argument("--budget", type=float, default=6.0)
    options = parser.parse_args()
    rows = []
    allowed = 1.2 * options.budget + 2.0
    with tempfile.TemporaryDirectory() as folder:
        for name in options.case or CASES:
            taken(words(CASES[name], 0.1 * options.budget), folder, 120.0)
            wall, busy, status, said = taken(
                words(CASES[name], options.budget), folder, 20.0 * allowed
            )
            load = os.getloadavg()[0]
            row = {
                "case": name,
                "asked": options.budget,
                "allowed": allowed,
                "wall": wall,
                "busy": busy,
                "load": load,
            }
            row |= {
                "held": wall <= allowed,
                "quietly": busy / CORES <= allowed,
                "status": status,
                "said": said,
            }
            rows.append(row)
            print(rows[-1], flush=True)
            report("budgets", rows)


if __name__ == "__main__":
    main()
