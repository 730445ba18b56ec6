"""What the benchmarks share: the scene, the figures' table, machine and versions."""

import json
import statistics
import sys
import time
from importlib import metadata
from pathlib import Path

from harvester.equations.coefficients import Equations
from harvester.machine.provenance import machine, versions

# The paper's parameters, and their converged E[V^2] (.08814 with standard error 6e-5,
# tests/systems.py).
PAPER = Equations(
    alpha=0.5, beta=0.05, mu=0.05, c1=0.01, c2=0.05, c3=0.1, restitution=0.96, n1=0.01, n2=0.01
)
PAPER_V2 = 0.0881
# of SSHI here: wound to order, and ngspice needs half of the time
COIL = {"L": 2.0, "Rcoil": 1.2e3, "Rcore": 500e3}
READING = 0.4  # time units between two readings of V^2, in everything that is compared


def best_of(function, repeats=5):
    """Median and smallest wall time of a call, in second, after one call that is not counted."""
    function()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        function()
        times.append(time.perf_counter() - begin)
    return statistics.median(times), min(times)


def counts(h, duration):
    """(steps between two readings, readings) for a time average over ``duration``."""
    every = max(1, round(READING / h))
    return every, max(1, round(duration / (every * h)))


def installed(*names):
    """Versions of those packages that are there."""
    found = {}
    for name in names:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def report(name, rows, packages=(), **more):
    """Print the rows and keep them with machine and versions in benchmarks/results/NAME.json."""
    for row in rows:
        print(
            "  ".join(
                f"{key} {value:.4g}" if isinstance(value, float) else f"{value}"
                for key, value in row.items()
            )
        )
    results = Path(__file__).parent / "results"
    results.mkdir(exist_ok=True)
    whole = {
        "rows": rows,
        **more,
        "machine": machine(),
        "versions": versions() | installed(*packages),
    }
    (results / f"{name}.json").write_text(json.dumps(whole, indent=1) + "\n")
    cores = whole["machine"]["cores"]
    print(
        f"{whole['machine']['processor']}, {cores} cores; written: benchmarks/results/{name}.json"
    )


def print_block(lines, page, begin, end):
    """Print generated lines, and with --page write them into a page, between the lines ``begin`` and ``end``."""
    print(*lines, sep="\n")
    if "--page" in sys.argv:
        before, _, rest = page.read_text().partition(begin)
        page.write_text("\n".join([f"{before}{begin}", *lines, f"{end}{rest.partition(end)[2]}"]))
