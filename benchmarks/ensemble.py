"""Trajectory-steps a second, and seconds to 1 % in E[V^2], on the paper's scene: this package beside its peers.

All run here, in turn, on one core and on both, several rounds.  Speed: the same step for all.  Seconds
to 1 %: every method at the step that suits it best.  A trajectory-time of T (all trajectories together,
after their start is forgotten) leaves E[V^2] a relative standard error sqrt(S/T), with S a property of
the scene, measured here; with a bias b of the step, |b| + 1.96 sqrt(S/T) = 1 % is reached after
T/h = S (1.96/(.01 - |b|))^2 / h steps.  Burn-in is left out of that for everyone.  What the package's own
engine needs with its burn-in, its estimate of the bias and its stopping rule is measured directly.
"""

import argparse
import importlib
import os
import statistics
import time
from multiprocessing import get_context

import numpy as np
from common import PAPER, PAPER_V2, counts, report

from harvester.mechanics.ensemble.trajectories import Trajectories

H = 0.1
BURN_IN = 150.0  # time units: seven times 1/mu
# Name: (module in peers/, options of its `averages`, trajectories and time units of a timed call).
PEERS = {
    "NumPy, tuned": ("numpy_arrays", {"way": "tuned"}, 16384, 40.0),
    "NumPy, plain": ("numpy_arrays", {"way": "plain"}, 16384, 40.0),
    "Runge-Kutta 4, NumPy": ("rk4", {}, 8192, 40.0),
    "diffrax, step on arrays": ("diffrax_steps", {"way": "arrays"}, 16384, 80.0),
    "diffrax, vmap, unsafe path": ("diffrax_steps", {"way": "unsafe"}, 16384, 20.0),
    "diffrax, vmap, Brownian tree": ("diffrax_steps", {"way": "documented"}, 16384, 8.0),
    "sdeint": ("sdeint_paths", {}, 1, 4000.0),
}
# Whose bias is measured, at which steps; the others make the same step as one of these.
BIASED = {
    "harvester": (0.8, 0.4, 0.2, 0.1),
    "NumPy, tuned": (0.4, 0.2, 0.1),
    "Runge-Kutta 4, NumPy": (0.1, 0.05, 0.025, 0.0125, 0.00625),
    "diffrax, step on arrays": (0.1, 0.05, 0.025, 0.0125, 0.00625),
}
SAME = {
    "NumPy, plain": "NumPy, tuned",
    "diffrax, vmap, unsafe path": "diffrax, step on arrays",
    "diffrax, vmap, Brownian tree": "diffrax, step on arrays",
    "sdeint": "diffrax, step on arrays",  # Heun's method with reflection between steps
}


def averages(name, h, n, burn_in, duration, seed):
    """Time average of V^2 of each trajectory, by one method."""
    if name == "harvester":
        many = Trajectories(PAPER, n, np.random.SeedSequence(seed), h)
        if burn_in:
            many.run(burn_in)
        return many.run(duration).V2
    module, options, *_ = PEERS[name]
    return importlib.import_module(f"peers.{module}").averages(
        h, n, burn_in, duration, seed, **options
    )


def rate(job):
    """Million trajectory-steps a second of one process: by the clock, and by its processor time."""
    name, n, duration = job
    every, readings = counts(H, duration)
    begin, busy = time.perf_counter(), time.process_time()
    averages(name, H, n, 0.0, duration, 1)
    seconds = np.array([time.perf_counter() - begin, time.process_time() - busy])
    return n * every * readings / seconds / 1e6


def bias(job):
    name, h, n, duration, seed = job
    return averages(name, h, n, BURN_IN, duration, seed)


def pin(core):
    if core is not None:
        os.sched_setaffinity(0, {core})


class Workers:
    """Processes that wait: one bound to a core, or one free, or one for each core."""

    def __init__(self, count, core=None):
        self.count = count
        self.pool = get_context("spawn").Pool(count, pin, (core,))

    def rate(self, *job):
        return np.sum(self.pool.map(rate, [job] * self.count, chunksize=1), axis=0)


def speeds(names, rounds, cores):
    """Name -> {"one core": rates, "all cores": rates}, all methods in turn in every round."""
    found = {name: {"one core": [], "all cores": []} for name in names}
    pools = {}
    for name in names:
        # Threads of its own (this package, XLA), or a process a core; of XLA the faster of the two
        # counts.
        every = [Workers(1)] if name == "harvester" else [Workers(cores)]
        every += [Workers(1)] if name.startswith("diffrax") else []
        pools[name] = {"one core": [Workers(1, 0)], "all cores": every}
    for k in range(rounds + 1):
        for name in names:
            n, duration = (16384, 800.0) if name == "harvester" else PEERS[name][2:]
            for which, some in pools[name].items():
                # processor time: other work does not stretch it
                clock = 1 if which == "one core" else 0
                best = max(float(workers.rate(name, n, duration)[clock]) for workers in some)
                if k > 0:  # the first compiles
                    found[name][which].append(best)
    for some in pools.values():
        for workers in [*some["one core"], *some["all cores"]]:
            workers.pool.terminate()
    return found


def biases(names, total, cores):
    """Name -> [(h, relative bias, its standard error)] from a trajectory-time ``total``; and S."""
    found = {}
    spread = []
    n = 8192
    for name in names:
        found[name] = []
        processes = 1 if name == "harvester" else cores
        with get_context("spawn").Pool(processes) as pool:
            for h in BIASED[name]:
                duration = total / n / processes
                parts = pool.map(
                    bias, [(name, h, n, duration, 7 + k) for k in range(processes)], chunksize=1
                )
                means = np.concatenate(parts)
                error = means.std(ddof=1) / np.sqrt(means.size) / PAPER_V2
                found[name].append((h, float(means.mean() / PAPER_V2 - 1.0), float(error)))
                if name == "harvester" and h <= 2 * H:
                    spread.append(float(error**2 * total))
    return found, statistics.mean(spread)


def steps_needed(table, spread, within=0.01):
    """(trajectory-steps, step, bias) to ``within``, at the best step; a bias in its noise counts as its error."""
    options = []
    for h, value, error in table:
        b = max(abs(value), error)
        if b < within:
            options.append((spread * (1.96 / (within - b)) ** 2 / h, h, value))
    return min(options, default=(float("inf"), 0.0, 0.0))


def direct(seeds):
    """Seconds and relative errors of the engine asked for 1 %, with everything that it does."""
    import harvester as hv

    scene = hv.load("examples/paper_figure3.toml")
    answers = [hv.Ensemble(within=0.01, seed=seed).run(scene) for seed in range(seeds + 1)][1:]
    errors = [a.mean_square_voltage.value / PAPER_V2 - 1.0 for a in answers]
    return statistics.median(a.seconds for a in answers), max(map(abs, errors))


def main(rounds, total):
    cores = os.cpu_count()
    names = ["harvester", *PEERS]
    speed = speeds(names, rounds, cores)
    table, spread = biases(BIASED, total, cores)
    rows = []
    for name in names:
        median = {which: statistics.median(values) for which, values in speed[name].items()}
        steps, h, value = steps_needed(table[SAME.get(name, name)], spread)
        row = {"what": name, **{f"million steps/s, {which}": median[which] for which in median}}
        row |= {"step for 1 %": h, "its bias": value, "million steps to 1 %": steps / 1e6}
        row["seconds to 1 %"] = steps / 1e6 / median["all cores"]
        if rows:
            row |= {
                f"slower, {which}": rows[0][f"million steps/s, {which}"] / median[which]
                for which in median
            }
            row["longer to 1 %"] = row["seconds to 1 %"] / rows[0]["seconds to 1 %"]
        rows.append(row)
    seconds, worst = direct(7)
    rows.append(
        {
            "what": "harvester's engine, within=0.01, all it does",
            "seconds to 1 %": seconds,
            "worst error": worst,
        }
    )
    for name, values in table.items():
        rows += [
            {"what": f"bias: {name}", "h": h, "of E[V^2]": b, "standard error": s}
            for h, b, s in values
        ]
    report("ensemble", rows, ("diffrax", "jax", "jaxlib", "sdeint"), spread=spread, rates=speed)


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--rounds", type=int, default=5)
    arguments.add_argument(
        "--time",
        type=float,
        default=1e7,
        help="trajectory-time of each bias: .14 %% standard error",
    )
    given = arguments.parse_args()
    main(given.rounds, given.time)
