"""What `harvester run --lifetime` says of impacts that are rare, against as many windows of a long path.

    python benchmarks/rare_impacts.py [--windows 300] [--gap "2 mm"]

A linear plate beside a stop that most windows of the extrapolation's path do not meet.  A path of
300 hours is cut into windows of an hour, whose largest impact speeds are counted; and each ninth
hour or so of it, as long as the path of one answer, is extrapolated by itself.  About two minutes
of processor time.
"""

import argparse
import time

import numpy as np

import harvester as hv
from harvester.equations.problem import Problem
from harvester.studies.extremes.counted import BLOCKS, count
from harvester.studies.extremes.levels import rare

PLATE = {
    "oscillator": hv.Oscillator(mass="40 g", stiffness="16 N/m", damping="6.4e-3 N s/m"),
    "piezo": hv.Piezo(coupling="3e-4 N/V", capacitance="50.2 nF"),
    "load": hv.Load(resistance="1 Mohm"),
    "excitation": hv.Excitation(acceleration_psd="1e-5 g^2/Hz"),
}
HOUR = 3600.0


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--windows", type=int, default=300)
    parser.add_argument("--gap", default="2 mm")
    options = parser.parse_args()
    problem = Problem(hv.Scene(stop=hv.Stop(restitution=0.9, gap=options.gap), **PLATE))
    units = problem.units
    begin = time.process_time()
    few = count(problem.equations, seed=1, blocks=64)
    a_window = round(HOUR * units.frequency / few.block)
    path = count(problem.equations, seed=1, blocks=options.windows * a_window)
    assert path.block == few.block, "the blocks of the long path are as long"
    speeds = path.speed * units.length * units.frequency
    largest = speeds[: len(speeds) // a_window * a_window].reshape(-1, a_window).max(axis=1)
    print(f"{len(largest)} windows of {a_window * path.block / units.frequency:.0f} s, "
          f"{(speeds > 0).mean():.1%} of the blocks have an impact, {time.process_time() - begin:.0f} s")  # fmt: skip
    for share in (0.5, 0.95):
        rank = 1.96 * np.sqrt(share * (1.0 - share) / len(largest))
        true, low, high = np.quantile(largest, [share, share - rank, min(share + rank, 1.0)])
        found = [
            rare(part, k) for k, part in enumerate(np.array_split(speeds, len(speeds) // BLOCKS))
        ]
        told = [one.largest(share, a_window) for one in found if one is not None]
        inside = sum(
            one.value - one.error95 <= high and one.value + one.error95 >= low for one in told
        )
        print(f"{share:.0%} of the windows stay below {true:.4f} m/s ({low:.4f} to {high:.4f}); "
              f"{len(told)} of {len(found)} extrapolations have an answer, {inside} of them hold it; "
              f"mean {np.mean([one.value for one in told]):.4f}, "
              f"stated +-{np.mean([one.error95 for one in told]):.4f}, "
              f"spread {np.std([one.value for one in told], ddof=1):.4f}")  # fmt: skip


if __name__ == "__main__":
    main()
