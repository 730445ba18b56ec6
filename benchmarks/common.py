"""What every benchmark prints besides its figures: machine and versions."""

import json
import statistics
import time
from pathlib import Path

from harvester.provenance import machine, versions


def best_of(function, repeats=5):
    """Median and smallest wall time of a call, in second, after one call that is not counted."""
    function()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        function()
        times.append(time.perf_counter() - begin)
    return statistics.median(times), min(times)


def report(name, rows):
    """Print the rows and keep them with machine and versions in out/bench-NAME.json."""
    for row in rows:
        print("  ".join(f"{key} {value:.4g}" if isinstance(value, float) else f"{value}" for key, value in row.items()))
    out = Path("out")
    out.mkdir(exist_ok=True)
    whole = {"rows": rows, "machine": machine(), "versions": versions()}
    (out / f"bench-{name}.json").write_text(json.dumps(whole, indent=2) + "\n")
    print(f"{whole['machine']['processor']}, {whole['machine']['cores']} cores; written: out/bench-{name}.json")
