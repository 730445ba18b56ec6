"""Accuracy on demand: is `--within` kept, and what does the control variate save?

1. Over many seeds, the share of `--within 2%` that lies within 2 % of the reference: `ensemble` (with a netlist,
   `ideal`) and `spice`, in three scenes.  The reference is the engine's own, asked for .2 %: `ideal` does not know the
   error of its model.
2. `spice` paired with a cheap model against `spice` alone, at the same standard error: seconds of ngspice alone scale
   with the square of its standard error; both estimates must agree.
3. The paper's scene within 1 %, engine by engine, in seconds without compilation.
"""

import argparse
import statistics

from common import report

import harvester as hv
from harvester.uncertainty.value import z_score

SCENES = {
    name: hv.load(f"examples/{name}.toml")
    for name in ("paper_figure3", "plate_with_stop", "plate_bridge")
}


def cheap(name):
    return hv.Ideal if name == "plate_bridge" else hv.Ensemble


def kept(seeds, within=0.02):
    """Share of answers within the target, scene by scene and engine by engine, and how far they are off."""
    rows = []
    for name, scene in SCENES.items():
        for kind in (cheap(name), hv.Spice):
            reference = kind(within=0.002, seed=10_000).run(scene).mean_power
            answers = [kind(within=within, seed=seed).run(scene) for seed in range(seeds)]
            off = [answer.mean_power.value / reference.value - 1.0 for answer in answers]
            row = {
                "scene": name,
                "engine": kind.NAME,
                "seeds": seeds,
                "inside": sum(abs(o) <= within for o in off),
            }
            row |= {"mean off": statistics.mean(off), "spread": statistics.stdev(off)}
            row |= {
                "median s": statistics.median(a.seconds for a in answers),
                "reference": reference.value,
            }
            rows.append(row | {"its error": reference.known_error95 / reference.value})
            print(rows[-1], flush=True)
    return rows


def saved(targets):
    """Seconds of ngspice alone over seconds with the control variate, at the standard error that the latter reached."""
    rows = []
    for name, scene in SCENES.items():
        alone = hv.Spice(alone=True, seed=7).run(scene)
        for within in targets:
            paired = hv.Spice(within=within, seed=8).run(scene)
            ratio = alone.mean_power.stderr / paired.mean_power.stderr
            row = {
                "scene": name,
                "within": within,
                "paired s": paired.seconds,
                "alone s": alone.seconds,
            }
            row |= {"alone stderr": alone.mean_power.stderr / alone.mean_power.value}
            row |= {"paired stderr": paired.mean_power.stderr / paired.mean_power.value}
            row |= {"correlation": paired.details["control_correlation"]}
            row |= {"times cheaper": alone.seconds * ratio**2 / paired.seconds}
            rows.append(row | {"z": z_score(paired.mean_power, alone.mean_power)})
            print(rows[-1], flush=True)
    return rows


def within_one_percent():
    """The paper's scene, median of five runs."""
    rows = []
    for kind in (hv.Averaged, hv.Ensemble, hv.Spice):
        kind(within=0.01).run(SCENES["paper_figure3"])
        answers = [kind(within=0.01).run(SCENES["paper_figure3"]) for _ in range(5)]
        error = answers[0].mean_power.known_error95 / answers[0].mean_power.value
        rows.append(
            {
                "engine": kind.NAME,
                "seconds": statistics.median(a.seconds for a in answers),
                "error": error,
            }
        )
    return rows


def main(seeds):
    rows = [*within_one_percent(), *saved((0.01, 0.003, 0.001)), *kept(seeds)]
    report("on_demand", rows)


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--seeds", type=int, default=100)
    main(arguments.parse_args().seeds)
