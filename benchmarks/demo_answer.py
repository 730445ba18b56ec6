"""The last line of `make demo`: the best load of a sweep, its power, and how well the engines agree.

    python benchmarks/demo_answer.py out/plate_with_stop/sweep.csv

An engine that states its whole error counts; the power is the mean over these engines, and the
agreement the largest deviation of any of them from that mean, over all loads of the table.  Nothing
of the package is imported.
"""

import csv
import sys
from collections import defaultdict
from pathlib import Path

NAMES = {"averaged": "formula", "ensemble": "Monte Carlo", "spice": "ngspice"}
KEY = "load.resistance"


def answer(table: Path) -> str:
    """The sentence for a table of `harvester sweep` over the load resistance."""
    known, unknown = defaultdict(dict), defaultdict(dict)
    with table.open(newline="") as file:
        for row in csv.DictReader(file):
            if row["mean_power"]:
                side = known if row["mean_power_error95"] else unknown
                side[float(row[KEY])][row["engine"]] = float(row["mean_power"])
    means = {load: sum(powers.values()) / len(powers) for load, powers in known.items()}
    best = max(means, key=means.__getitem__)
    engines = list(dict.fromkeys(engine for powers in known.values() for engine in powers))
    off = max(
        abs(power / means[load] - 1.0)
        for load, powers in known.items()
        for power in powers.values()
    )
    *first, last = [NAMES.get(engine, engine) for engine in engines]
    who = (
        f"{', '.join(first)} and {last} agree within {100.0 * off:.1f} %" if first else f"by {last}"
    )
    text = f"Best load {best / 1e3:.3g} kohm: {1e6 * means[best]:.2g} uW; {who}"
    high = defaultdict(float)
    for load, powers in unknown.items():
        for engine, power in powers.items():
            if load in means:
                high[engine] = max(high[engine], power / means[load] - 1.0)
    for engine, most in high.items():
        text += f"; {engine} is up to {100.0 * most:.0f} % too high"
    return f"{text}."


if __name__ == "__main__":
    print(answer(Path(sys.argv[1])))
