"""How often the intervals of `harvester identify` hold the truth: 100 synthetic measurements of each kind.

python benchmarks/identify.py [--count 100] [KIND ...]

For each number: how many intervals hold it, and how far off the value is.  Below, how many
half-widths of its interval the worst number of all files is off, and in how many files one is off
by more than five without a warning.  Ring-downs against a stop (`bounces`) take a second each.
"""

import argparse
import collections
import tempfile
import time
from pathlib import Path

import numpy as np

import harvester as hv
from tests.support.bench import KINDS


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*", choices=[[], *KINDS], default=[])
    parser.add_argument("--count", type=int, default=100)
    asked = parser.parse_args()
    for kind in asked.kinds or KINDS:
        held = collections.Counter()
        open_ = collections.Counter()
        off = collections.defaultdict(list)
        begin = time.process_time()
        worst = 0.0
        silent = 0
        for seed in range(asked.count):
            with tempfile.TemporaryDirectory() as folder:
                names, truth = KINDS[kind](np.random.default_rng([22, seed]), Path(folder))
                answer = hv.identify(names)
            found = {one.key: one for one in answer.parameters}
            far = 0.0
            for key, value in truth.items():
                if key not in found:
                    open_[key] += 1
                    continue
                held[key] += found[key].low <= value <= found[key].high
                off[key].append(abs(found[key].value - value) / value)
                far = max(
                    far,
                    2.0
                    * abs(found[key].value - value)
                    / max(found[key].high - found[key].low, 1e-300),
                )
            worst = max(worst, far)
            silent = silent + (far > 5.0 and not answer.warnings)
        seconds = (time.process_time() - begin) / asked.count
        print(f"{kind}: {asked.count} devices, {seconds:.2f} s each; at worst {worst:.1f} half-widths off, "
              f"silently by more than five in {silent} files")  # fmt: skip
        for key in truth:
            missing = f", not determined in {open_[key]}" if open_[key] else ""
            print(f"  {key:<26} held by {held[key]:3d}, median error {100 * np.median(off[key]):.3g} %, "
                  f"largest {100 * max(off[key], default=0):.3g} %{missing}")  # fmt: skip


if __name__ == "__main__":
    main()
