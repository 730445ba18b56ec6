"""An attack on the program: random scenes and netlists, faults of the machine, and thousands of ngspice runs.

1. `scenes`: random scenes through every engine, as many odd ones as sensible ones.
2. `netlists`: random netlists, and the package's with a random line, in programs whose every opened file strace tells.
3. `faults`: signals at random moments, a full disk, little memory, few descriptors, bad caches, clocks that jump.
4. `growth`: memory, descriptors, threads and files after thousands of ngspice runs, and what a day would make of them.

A break is what the program promises not to do (docs/reliability.md): it is printed, and kept with
its seed in benchmarks/results/attack.json.
"""

import argparse
import importlib
import json
import math
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "benchmarks"), str(ROOT)]

from attacks.tally import Tally  # noqa: E402
from common import report  # noqa: E402

PARTS = {"scenes": 3000, "netlists": 1000, "faults": 300, "growth": 5000}  # how many by default


def without_places(text):
    """A text without the folders of this machine."""
    for place, name in (
        (ROOT, "."),
        (sys.prefix, "PREFIX"),
        (sys.base_prefix, "PYTHON"),
        (tempfile.gettempdir(), "TMP"),
    ):
        text = text.replace(str(place), name)
    return text


def main(parts, seed, count, budget):
    """The parts asked for go on where they stopped; what was found in the others, and with other seeds, stays.

    But `growth` begins anew: it looks at what grows in one process.
    """
    path = Path(__file__).parent / "results" / "attack.json"
    rows = json.loads(path.read_text())["rows"] if path.exists() else []
    for part in parts:
        before = [
            row for row in rows if (row["part"], row["seed"]) == (part, seed) and part != "growth"
        ]
        tally, more = Tally(count or PARTS[part], budget, *before), None
        try:
            more = importlib.import_module(f"attacks.{part}").attack(tally, seed)
        finally:  # after ^C too
            found = {"part": part, "seed": seed, **tally.found(), **(more or {})}
            found["breaks"] = json.loads(without_places(json.dumps(found["breaks"])))
            rows = [row for row in rows if (row["part"], row["seed"]) != (part, seed)] + [found]
            report("attack", rows, ("loky", "hypothesis"))


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("part", choices=[*PARTS, "all"])
    arguments.add_argument("--seed", type=int, default=17)
    arguments.add_argument(
        "--count", type=int, help="default: " + ", ".join(f"{n} {c}" for n, c in PARTS.items())
    )
    arguments.add_argument(
        "--budget", type=float, default=math.inf, metavar="SECONDS", help="of each part"
    )
    asked = arguments.parse_args()
    main([*PARTS] if asked.part == "all" else [asked.part], asked.seed, asked.count, asked.budget)
