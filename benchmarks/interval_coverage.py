"""Whether 95 % intervals hold what they state: the share of many seeds inside, scene by scene, with its own interval.

Each scene is run with many seeds, as a user would with `--within`.  Two shares are counted.

    sampling   inside their 95 % of sampling of the mean of all the other seeds: near 0.95 if the spread is honest
    whole      inside their `error95` of a reference of other seeds, at a fifth of the target: 0.95 or more, because the
               bias of the step is added in full.  Of ngspice the reference is a mean of runs at half the step and a
               tenth of the tolerance, where `--references` asks for it.

    .venv/bin/python benchmarks/interval_coverage.py --seeds 200
    .venv/bin/python benchmarks/interval_coverage.py "bridge, stop (spice)" --seeds 100 --references 8

Rows of scenes that are not run stay in the table.  The interval of a share is Wilson's, at 95 %.
"""

import argparse
import dataclasses
import json
import math
import tempfile
import time
from pathlib import Path

import numpy as np
from common import report

import harvester as hv

EXAMPLES = Path(__file__).parents[1] / "examples"
ND = {"alpha": 0.5, "beta": 0.05, "mu": 0.05, "c1": 0.01, "c2": 0.05, "c3": 0.1, "D11": 0.01, "D22": 0.01}
OTHERS = 6  # seeds of a reference
STOP = hv.Stop(restitution=0.96)


def nondimensional(**changed):
    """The paper's scene with some keys changed, None: left out."""
    return hv.Scene(nondimensional=hv.Nondimensional(**{k: v for k, v in (ND | changed).items() if v is not None}))


def example(name, **changed):
    """An example with some tables changed."""
    return dataclasses.replace(hv.load(EXAMPLES / f"{name}.toml"), **changed)


def own_netlist(folder):
    """The bridge with a Zener diode of examples/own_netlist.py."""
    text = (EXAMPLES / "own_netlist.py").read_text().split('LIMITED = """')[1].split('"""')[0]
    path = Path(folder) / "limited.cir"
    path.write_text(text)
    load = hv.Load(netlist=str(path), parameters={"R": "1 Mohm", "C": "0.2 uF"})
    return dataclasses.replace(example("plate_bridge"), load=load)


def scenes(folder):
    """Name, scene, engine and target of each."""
    sampled = {
        "paper, r = .96": nondimensional(restitution=0.96),
        "no stop": nondimensional(),
        "mu = 3": nondimensional(restitution=0.96, mu=3.0),
        "r = .7": nondimensional(restitution=0.7),
        "bistable": example("plate_bistable"),
        "two stops": example("plate_two_stops"),
        "coloured": example("plate_coloured"),
    }
    for name, scene in sampled.items():
        yield name, scene, hv.Ensemble, 0.01
    yield "bridge, stop (ideal)", example("plate_bridge", stop=STOP), hv.Ideal, 0.01
    yield "resistor, stop (spice)", example("plate_with_stop"), hv.Spice, 0.02
    yield "bridge, stop (spice)", example("plate_bridge", stop=STOP), hv.Spice, 0.02
    yield "parallel SSHI, stop (spice)", example("plate_parallel_sshi"), hv.Spice, 0.02
    yield "own netlist (spice)", own_netlist(folder), hv.Spice, 0.02


def wilson(inside, count):
    """The 95 % interval of a share."""
    z, share = 1.96, inside / count
    centre, width = share + z * z / (2 * count), z * math.sqrt(share * (1 - share) / count + (z / (2 * count)) ** 2)
    return [(centre + sign * width) / (1 + z * z / count) for sign in (-1, 1)]


def reference(scene, engine, within, several):
    """The mean power and its standard error, of other seeds, and at a finer step; None for ngspice without several."""
    if engine is not hv.Spice:
        powers = [engine(within=within / 5.0, seed=1_000_000 + k).run(scene).mean_power for k in range(OTHERS)]
        error = math.hypot(*(one.stderr or 0.0 for one in powers)) / OTHERS
        return float(np.mean([one.value for one in powers])), error
    if not several:
        return None
    first = hv.Spice(within=within, seed=1_000_000).run(scene)
    finer = {"dt": 0.5 * first.details["step"], "reltol": 1e-5, "within": within}
    powers = [hv.Spice(**finer, seed=1_000_001 + k).run(scene).mean_power.value for k in range(several)]
    return float(np.mean(powers)), float(np.std(powers, ddof=1) / math.sqrt(several)) if several > 1 else 0.0


def measured(name, scene, engine, within, options):
    """One row of the table."""
    begin, busy, answers = time.perf_counter(), time.process_time(), []
    for seed in range(options.seeds):
        answers.append(engine(within=within, seed=seed).run(scene).mean_power)
        if time.perf_counter() - begin > options.most:
            break
    seconds, busy = (time.perf_counter() - begin) / len(answers), (time.process_time() - busy) / len(answers)
    values, count = np.array([one.value for one in answers]), len(answers)
    others = (values.sum() - values) / (count - 1)
    inside = sum(bool(abs(one.value - mean) <= one.sampling95) for one, mean in zip(answers, others, strict=True))
    row = {"scene": name, "within": within, "seeds": count, "seconds": seconds, "process seconds": busy}
    row |= {"spread": float(values.std(ddof=1) / values.mean())}
    row |= {"stated": float(np.mean([one.stderr for one in answers]) / values.mean())}
    row |= {"sampling inside": inside / count, "sampling interval": wilson(inside, count)}
    row["whole error known"] = sum(one.whole_error95 is not None for one in answers) / count
    known = reference(scene, engine, within, options.references)
    if known is not None:
        truth, error = known
        held = sum(abs(one.value - truth) <= one.error95 for one in answers)
        row |= {"reference": truth, "reference stderr": error, "bias seen": float(values.mean() / truth - 1.0)}
        row |= {"whole inside": held / count, "whole interval": wilson(held, count)}
    return row


def main():
    """Measure the scenes that are named, all by default, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="*", help="names of scenes; default: all")
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--references", type=int, default=0, help="runs of ngspice that make its reference")
    parser.add_argument("--most", type=float, default=1e9, help="seconds a scene, after which no further seed is run")
    options = parser.parse_args()
    results = Path(__file__).parent / "results" / "interval_coverage.json"
    rows = {one["scene"]: one for one in json.loads(results.read_text())["rows"]} if results.exists() else {}
    with tempfile.TemporaryDirectory() as folder:
        every = {name: (name, *more) for name, *more in scenes(folder)}
        for name in options.scene or every:
            rows[name] = measured(*every[name], options)
            report("interval_coverage", [rows[one] for one in every if one in rows])


if __name__ == "__main__":
    main()
