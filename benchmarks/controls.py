"""What controls from Ito's formula are worth: variance, cost of a step and seconds to .1 % in E[V^2], with and without.

Both run here in turn, in one process, several rounds, on the same trajectories; the smallest time of the processor
(all threads together) counts.
A trajectory-time of T (all trajectories together, after their start is forgotten) leaves E[V^2] the relative standard
error sqrt(S/T), and .1 % at 95 % takes T = S (1.96/.001)^2.  Burn-in and the bias of the step are left out for both.
"""

import argparse
import dataclasses
import os
import time
from pathlib import Path

import numpy as np
from common import PAPER, report

from harvester.circuits.idealised import ideal_circuit
from harvester.engines.ensemble import Ensemble
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.mechanics.ensemble.burn_in import burn_in
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.scene.physical import Stop
from harvester.scene.toml import load
from harvester.uncertainty.value import mean_and_error

LINEAR = Equations(beta=0.05, mu=0.05, c1=-0.05, n1=0.01)
SCENES = {
    "paper, r = .96": PAPER,
    "no stop": dataclasses.replace(PAPER, restitution=None),
    "linear, no stop": LINEAR,
    "linear, stop": dataclasses.replace(LINEAR, restitution=0.96),
    "mu = 3": dataclasses.replace(PAPER, mu=3.0),
    "r = .7": dataclasses.replace(PAPER, restitution=0.7),
    "mu = 1, beta = .5, r = .9": dataclasses.replace(PAPER, mu=1.0, beta=0.5, restitution=0.9),
    "gap .5": dataclasses.replace(PAPER, gap=0.5),
    "two stops": dataclasses.replace(PAPER, gap=0.5, opposite_gap=0.5, opposite_restitution=0.9),
    "two wells": Equations(linear=-1.0, alpha=1.0, beta=0.1, mu=0.5, c1=-0.1, n1=0.05),
    "coloured, stop": dataclasses.replace(
        PAPER, n1=None, n2=None, coloured=0.01, correlation_time=0.5
    ),
    "band, stop": dataclasses.replace(
        PAPER, n1=None, n2=None, coloured=0.01, centre=1.5, bandwidth=0.5
    ),
}
EXAMPLES = Path(__file__).parents[1] / "examples"
# Examples with circuits of ideal elements, as they are and with their stop or another one
CIRCUITS = (
    "plate_bridge",
    "plate_doubler",
    "plate_parallel_sshi",
    "plate_series_sshi",
    "plate_sece",
)
MOMENTS = ("V2", "x2", "v2", "impacts")


def circuits():
    """Name, equations and circuit of each example in `CIRCUITS`, without a stop and with one."""
    for name in CIRCUITS:
        scene = load(EXAMPLES / f"{name}.toml")
        for stop in (None, Stop(restitution=0.96)):
            problem = Problem.of(dataclasses.replace(scene, stop=stop))
            circuit = ideal_circuit(problem.circuit, problem.scales)
            yield (
                f"{name.removeprefix('plate_')}, {'no stop' if stop is None else 'stop'}",
                problem.equations,
                circuit,
            )


def measured(name, eqs, count, duration, rounds, circuit=None):
    """One row of the table; for a circuit the power into its load counts, in place of E[V^2]."""
    many = Trajectories(eqs, count, np.random.SeedSequence(1), circuit=circuit, controlled=True)
    burn_in(many)
    many.run(1.0)
    seconds = {False: [], True: []}
    for _ in range(rounds):
        for controlled in (False, True):
            many.controlled = controlled
            begin = time.process_time()
            found = many.run(duration)
            seconds[controlled].append(time.process_time() - begin)
    row = {"scene": name}
    first = "V2" if circuit is None else "load"
    for moment in (first, *MOMENTS[1:]):
        error = mean_and_error(found.controlled(moment))[1]
        row[f"{moment} variance ratio"] = (
            (mean_and_error(getattr(found, moment))[1] / error) ** 2 if error > 0.0 else 1.0
        )
    steps = count * duration / many.h
    row["ns/step plain"], row["ns/step controlled"] = (
        1e9 * min(seconds[c]) / steps for c in (False, True)
    )
    row["cost ratio"] = min(seconds[True]) / min(seconds[False])
    row["accuracy a second"] = row[f"{first} variance ratio"] / row["cost ratio"]
    error = mean_and_error(getattr(found, first))[1] / getattr(found, first).mean()
    row["s to .1 % plain"] = min(seconds[False]) * (1.96 * error / 1e-3) ** 2
    row["s to .1 % controlled"] = row["s to .1 % plain"] / row["accuracy a second"]
    return row


class Plain(Ensemble):
    """The engine without controls: plain means, of more trajectories."""

    CONTROLS = False


def whole_jobs(within, seeds):
    """Seconds of whole answers of engine `ensemble` for the paper's scene, with and without controls in turn.

    ``within``: the whole error at 95 % that is asked for, of E[V^2].  Burn-in, the bias of the step and all else
    included; compilation and the start of Python are not.  On the clock and of the processor, the smallest and the
    median of the seeds; the least of the processor says by how much controls are cheaper.
    """
    scene = load(EXAMPLES / "paper_figure3.toml")
    kinds = {"with controls": Ensemble, "plain": Plain}
    taken = {name: [] for name in kinds}
    for seed in range(seeds + 1):
        for name, kind in kinds.items():
            begin, busy = time.perf_counter(), time.process_time()
            value = kind(within=within, seed=seed).run(scene).mean_square_voltage
            taken[name].append(
                (
                    time.perf_counter() - begin,
                    time.process_time() - busy,
                    value.known_error95 / value.value,
                )
            )
    row = {"within": within, "seeds": seeds}
    for name, found in taken.items():
        wall, busy, error = np.array(found[1:]).T  # the first reads the kernels
        row |= {f"{name}, s": wall.min(), f"{name}, median s": np.median(wall)}
        row |= {f"{name}, processor s": busy.min(), f"{name}, median processor s": np.median(busy)}
        row[f"{name}, largest error"] = error.max()
    return row | {
        "times cheaper": row["plain, median processor s"] / row["with controls, median processor s"]
    }


def main():
    """Measure every scene and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trajectories", type=int, default=2048)
    parser.add_argument("--duration", type=float, default=400.0)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seeds", type=int, default=9)
    options = parser.parse_args()
    whole = [whole_jobs(within, options.seeds) for within in (1e-2, 1e-3)]
    for row in whole:
        print("  ".join(f"{name} {value:.3g}" for name, value in row.items()), flush=True)
    sizes = options.trajectories, options.duration, options.rounds
    rows = [measured(name, eqs, *sizes) for name, eqs in SCENES.items()]
    rows += [measured(name, eqs, *sizes, circuit) for name, eqs, circuit in circuits()]
    report("controls", rows, options=vars(options), whole=whole, load=os.getloadavg()[0])


if __name__ == "__main__":
    main()
