"""What engine `density` reaches: random scenes against sampling and a finer mesh, seconds and memory, hard scenes.

    python benchmarks/density.py [--scenes 25] [--seed 1] [--only scenes|cost|hard|corrected]

The result is benchmarks/results/density.json.  OPENBLAS_NUM_THREADS=1 makes its seconds comparable.

Scenes: E[V^2] of `density` against `ensemble` at small steps (z with the joint standard error and
the step's bias), and against `density` itself with a finer mesh, more modes and a wider box, in
multiples of the stated error.
"""

import argparse
import json
import math
import resource
import time
from pathlib import Path

import numpy as np

import harvester as hv
from harvester.density.refine import refined
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError

RESULT = Path(__file__).parent / "results" / "density.json"
PAPER = {
    "c1": 0.01,
    "c2": 0.05,
    "c3": 0.1,
    "alpha": 0.5,
    "beta": 0.05,
    "mu": 0.05,
    "D11": 0.01,
    "D22": 0.01,
}


def random_table(rng):
    """A nondimensional scene with white noise: every kind of stop, spring and damping in turn by chance."""
    table = {
        "c1": -(10.0 ** rng.uniform(-1.7, -0.5)),
        "beta": 10.0 ** rng.uniform(-2.0, -0.2),
        "mu": 10.0 ** rng.uniform(-1.0, 0.6),
        "D11": 0.01,
    }
    if rng.random() < 0.5:
        table["alpha"] = rng.uniform(0.1, 1.0)
    if rng.random() < 0.3:
        table["c3"] = rng.uniform(0.02, 0.2)
        table["D22"] = rng.uniform(0.001, 0.01)
    kind = rng.choice(["rest", "gap", "preload", "two", "compliant", "none"])
    if kind in ("rest", "gap", "preload", "two"):
        table["restitution"] = rng.uniform(0.2, 0.98)
    if kind == "gap":
        table["gap"] = rng.uniform(0.05, 0.5)
    if kind == "preload":
        table["gap"] = -rng.uniform(0.05, 0.2)
    if kind == "two":
        table |= {"gap": rng.uniform(0.1, 0.4), "opposite_restitution": rng.uniform(0.3, 0.98)}
        table["opposite_gap"] = rng.uniform(0.1, 0.4)
    if kind == "compliant":
        table |= {
            "gap": rng.uniform(0.05, 0.3),
            "stop_stiffness": rng.uniform(5.0, 60.0),
            "stop_damping": 0.5,
        }
    return table


def scenes(count, seed):
    """One line a scene, and the largest of both comparisons."""
    rng = np.random.default_rng(seed)
    worst_z = 0.0
    worst = 0.0
    rows = []
    for k in range(count):
        scene = hv.Scene(nondimensional=hv.Nondimensional(**random_table(rng)))
        begin = time.process_time()
        try:
            ours = hv.Density(within=1e-4).run(scene).mean_square_voltage
        except HarvesterError as error:
            print(f"{k:3d} refused: {error}", flush=True)
            rows.append({"scene": k, "refused": str(error)})
            continue
        took = time.process_time() - begin
        better = refined(Problem.of(scene).equations, 0.3 * ours.bias / ours.value)
        off = abs(ours.value - float(better.means[0])) / ours.bias
        sampled = (
            hv.Ensemble(trajectories=4096, duration=500.0, dt=0.01, seed=k)
            .run(scene)
            .mean_square_voltage
        )
        z = (sampled.value - ours.value) / math.hypot(
            sampled.stderr, sampled.bias or 0.0, ours.bias
        )
        worst_z = max(worst_z, abs(z))
        worst = max(worst, off)
        error, spread = ours.bias / ours.value, sampled.stderr / sampled.value
        told = {
            "scene": k,
            "effects": Problem.of(scene).effects[1:],
            "v2": ours.value,
            "error": error,
            "seconds": took,
        }
        rows.append(
            told
            | {"share_of_error": off, "ensemble": sampled.value, "ensemble_stderr": spread, "z": z}
        )
        print(
            f"{k:3d} E[V^2] {ours.value:.9g} +- {error:.0e}  {took:.1f} s CPU  off the better {off:.2f} of the error  "
            f"ensemble {sampled.value:.6g} +- {spread:.0e}  z {z:+.2f}  {'+'.join(Problem.of(scene).effects[1:])}",
            flush=True,
        )
    print(f"largest |z| {worst_z:.2f}, largest share of the stated error {worst:.2f}")
    return rows


def cost():
    """Processor seconds and the process's largest memory for three accuracies, of the paper's scene."""
    rows = []
    for within in (1e-4, 1e-6, 1e-8):
        begin = time.process_time()
        answer = hv.Density(within=within).run(
            hv.Scene(nondimensional=hv.Nondimensional(**PAPER, restitution=0.96))
        )
        v2 = answer.mean_square_voltage
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        told = {"within": within, "v2": v2.value, "error": v2.bias / v2.value}
        rows.append(told | {"seconds": time.process_time() - begin, "MiB": memory})
        print(
            f"within {within:.0e}: E[V^2] = {v2.value:.12g} +- {v2.bias / v2.value:.0e}, "
            f"{time.process_time() - begin:.1f} s CPU, {memory:.0f} MiB",
            flush=True,
        )
    return rows


def hard():
    """Strong collisions against sampling, and the scenes in which modes of y converge slowly."""
    rows = []
    for restitution in (0.37, 0.1, 0.02):
        scene = hv.Scene(nondimensional=hv.Nondimensional(**PAPER, restitution=restitution))
        ours = hv.Density(within=1e-4).run(scene).mean_square_voltage
        print(f"r = {restitution}: {ours.value:.8g} +- {ours.bias / ours.value:.0e}", flush=True)
        for dt in (0.05, 0.0125):
            found = (
                hv.Ensemble(trajectories=4096, duration=2000.0, dt=dt)
                .run(scene)
                .mean_square_voltage
            )
            z = (found.value - ours.value) / found.stderr
            off = found.value / ours.value - 1.0
            rows.append(
                {
                    "restitution": restitution,
                    "dt": dt,
                    "off": off,
                    "z": z,
                    "density_error": ours.bias / ours.value,
                }
            )
            stated = (found.bias or 0.0) / found.value
            print(
                f"  ensemble, dt = {dt}: off {off:+.1e}, z {z:+.1f} without the step, stated {stated:.0e}",
                flush=True,
            )
    strong = {"c1": -0.05, "beta": 5.0, "mu": 0.05, "restitution": 0.96, "D11": 0.01}
    wells = {"c1": -0.2, "beta": 0.1, "mu": 0.05, "linear": -1.0, "alpha": 1.0, "D11": 0.01}
    for name, table in (
        ("strong coupling, slow load", strong),
        ("two deep wells, slow load", wells),
    ):
        begin = time.process_time()
        try:
            v2 = hv.Density(within=1e-3, budget=120.0).run(
                hv.Scene(nondimensional=hv.Nondimensional(**table))
            )
            told = f"{v2.mean_square_voltage.format()} {'; '.join(map(str, v2.warnings))}"
        except HarvesterError as error:
            told = str(error)
        rows.append({"scene": name, "answer": told, "seconds": time.process_time() - begin})
        print(f"{name}: {told}, {time.process_time() - begin:.0f} s CPU", flush=True)
    return rows


def corrected():
    """What other engines miss of E[V^2], and what they state, by restitution: theirs against the density's."""
    rows = []
    for restitution in (0.96, 0.8, 0.6, 0.37, 0.1):
        scene = hv.Scene(nondimensional=hv.Nondimensional(**PAPER, restitution=restitution))
        ours = hv.Density(within=1e-5).run(scene).mean_square_voltage
        for engine in (
            hv.Published(),
            hv.Averaged(),
            hv.Ensemble(trajectories=8192, duration=2000.0),
        ):
            found = engine.run(scene).mean_square_voltage
            off = found.value / ours.value - 1.0
            stated = found.error95
            stated = None if stated is None else stated / found.value
            rows.append(
                {"restitution": restitution, "engine": engine.NAME, "off": off, "stated": stated}
            )
            said = "not known" if stated is None else f"{stated:.1e}"
            print(f"r = {restitution}: {engine.NAME} off {off:+.1e}, stated {said}", flush=True)
    return rows


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=25)
    parser.add_argument("--seed", type=int, default=1)
    parts = {"cost": cost, "hard": hard, "corrected": corrected, "scenes": None}
    parser.add_argument("--only", choices=[*parts])
    asked = parser.parse_args()
    parts["scenes"] = lambda: scenes(asked.scenes, asked.seed)
    result = json.loads(RESULT.read_text()) if RESULT.exists() else {}
    for name, part in parts.items():
        if asked.only in (None, name):
            result[name] = part()
            RESULT.write_text(json.dumps(result, indent=1) + "\n")
