"""Seconds for the paper's Figure 1 by Monte Carlo at its full size: 80 x 80 starts, 1000 trajectories from each.

All 6.4 million trajectories run until the stationary state is reached, which a few from every start
find out; their states at the end make the histograms of the amplitude A, of x and of x'.

    python benchmarks/figure1.py          # full size
    python benchmarks/figure1.py 100      # a hundredth of the trajectories
"""

import sys
import time

import numpy as np
from common import PAPER, report

from harvester.averaging.published.orbit import amplitude_through
from harvester.mechanics.ensemble.burn_in import burn_in
from harvester.mechanics.ensemble.histograms import Histogram
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.coefficients import BATCH

GRID = 80
EACH = 1000
H = 0.1
EDGES = {"A": np.linspace(0, 2.4, 61), "x": np.linspace(0, 2.4, 61), "x'": np.linspace(-3, 3, 61)}


def starts(x, each):
    """All starting velocities at each of the displacements, V = 0: shape (3, trajectories), whole blocks."""
    v = (np.arange(GRID) + 0.5) / GRID * 6.0 - 3.0
    x, v = (grid.ravel().repeat(each) for grid in np.meshgrid(x, v, indexing="ij"))
    x, v = (np.resize(values, -(-values.size // BATCH) * BATCH) for values in (x, v))
    return np.array([x, v, np.zeros_like(v)])


def ensemble(start, seed):
    """Trajectories of the scene from these starts."""
    return Trajectories(PAPER, start.shape[1], np.random.SeedSequence([1, seed]), H, start)


def run(each):
    """Histograms, trajectories, and the time at which the states are taken."""
    rows = (np.arange(GRID) + 0.5) / GRID * 3.0
    pilot = ensemble(starts(rows, max(1, each // 100)), GRID)
    burn_in(pilot)
    states = {name: [] for name in EDGES}
    for k, x0 in enumerate(rows):
        many = ensemble(starts(x0, each), k)
        many.run(pilot.time)
        x, v, _ = many.snapshot()
        amplitude = amplitude_through(x, v, PAPER.alpha, PAPER.beta, PAPER.mu)
        for name, values in zip(EDGES, (amplitude, x, v), strict=True):
            states[name].append(values)
    densities = {}
    for name, edges in EDGES.items():
        histogram = Histogram(edges, GRID)
        histogram.add(np.concatenate(states[name]))
        densities[name] = histogram.density()
    return densities, GRID * many.count, pilot.time


if __name__ == "__main__":
    part = int(sys.argv[1]) if len(sys.argv) > 1 else 1
    run(1)  # compile
    begin = time.perf_counter()
    densities, trajectories, settled = run(max(1, EACH // part))
    seconds = time.perf_counter() - begin
    rows = [{"trajectories": trajectories, "time units": settled, "step": H, "seconds": seconds}]
    rows[0]["million steps/s"] = trajectories * settled / H / seconds / 1e6
    for name, density in densities.items():
        peak = density.value.argmax()
        rows.append(
            {"density": f"p({name})", "peak at": density.centres[peak], "peak": density.value[peak]}
        )
        rows[-1]["its standard error"] = density.stderr[peak]
        rows[-1]["total"] = density.value.sum() * np.diff(density.edges)[0]
    report("figure1", rows)
