"""The error that `averaged` states of itself, against engine `density` (no sampling), on random scenes.

    python benchmarks/averaged_error.py [--scenes 400] [--seed 1] [--keep FILE]

Restitution 0.3 to 1, beta 0.02 to 5, mu 0.01 to 30, half of the scenes with each further effect; a
sixth has no stop, the others one at rest, at a distance or preloaded.  One line a scene that lies
outside, then a table by kind of stop: how many are outside, the medians of the stated and of the
actual error, and of their ratio.  With --keep the referee's answers are written, and read again the
next time.  Some 2 s of processor time a scene.  More than two scenes outside are a failure.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np

import harvester as hv
from harvester.errors import HarvesterError

WITHIN = 1e-2  # of the referee, and the most that it may leave
LATEST = 120.0  # seconds for one scene
MOST = 2  # scenes outside


def between(rng, low, high):
    """A number whose logarithm is uniform."""
    return float(f"{np.exp(rng.uniform(np.log(low), np.log(high))):.5g}")


def random_table(rng):
    """A nondimensional scene with a stop; its gap is in proportion to the amplitude that the noise reaches."""
    table = {"c1": -between(rng, 0.002, 0.2), "D11": between(rng, 0.002, 0.05)}
    table |= {"beta": between(rng, 0.02, 5), "mu": between(rng, 0.01, 30)}
    restitution = float(f"{rng.uniform(0.3, 1.0):.5g}")
    for key, (low, high), sign in (
        ("alpha", (0.1, 5.0), 1.0),
        ("c2", (0.002, 0.1), -1.0),
        ("c3", (0.01, 0.2), 1.0),
        ("D22", (0.0005, 0.02), 1.0),
    ):
        if rng.random() < 0.5:
            table[key] = sign * between(rng, low, high)
    kind = rng.choice(["none", "at rest", "at rest", "gap", "gap", "preload"])
    rms = np.sqrt(table["D11"] / (-table["c1"] + (1.0 - restitution) / np.pi))
    if kind != "none":
        table["restitution"] = restitution
    if kind in ("gap", "preload"):
        size = between(rng, 0.02, 3.0) if kind == "gap" else -between(rng, 0.02, 1.0)
        table["gap"] = float(f"{rms * size:.5g}")
    return str(kind), table


def referee(table):
    """E[V^2] by `density` and its error, or the words of its refusal."""
    begin = time.process_time()
    try:
        v2 = hv.Density(within=WITHIN, budget=LATEST).run(_scene(table)).mean_square_voltage
    except HarvesterError as error:
        return {"refused": str(error)[:200], "seconds": time.process_time() - begin}
    return {"value": v2.value, "error": v2.bias, "seconds": time.process_time() - begin}


def _scene(table):
    return hv.Scene(nondimensional=hv.Nondimensional(**table))


def judged(kind, table, true):
    """One row: the actual relative error, and the stated one beyond what the referee leaves."""
    row = {"kind": kind, "table": table}
    if "refused" in true:
        return row | {"unjudged": true["refused"]}
    if true["error"] > WITHIN * true["value"]:
        return row | {"unjudged": f"the referee leaves {true['error'] / true['value']:.1%}"}
    try:
        v2 = hv.Averaged().run(_scene(table)).mean_square_voltage
    except HarvesterError as error:
        return row | {"unjudged": f"averaged: {error}"[:200]}
    if v2.model is None:
        return row | {"unjudged": "averaged knows no error here"}
    off = v2.value / true["value"] - 1.0
    stated = v2.model / v2.value  # of its own value, as it is printed
    left = true["error"] / true["value"]
    return row | {
        "off": off,
        "stated": stated,
        "outside": abs(off) * true["value"] > v2.model + true["error"],
        "left": left,
    }


def scenes(count, seed, keep):
    """Draw, solve both, and print the table; the exit status tells whether any scene lies outside."""
    rng = np.random.default_rng(seed)
    drawn = [random_table(rng) for _ in range(count)]
    known = json.loads(keep.read_text()) if keep and keep.exists() else {}
    rows = []
    for k, (kind, table) in enumerate(drawn):
        key = json.dumps(table, sort_keys=True)
        if key not in known:
            known[key] = referee(table)
            if keep:
                keep.write_text(json.dumps(known))
        rows.append(judged(kind, table, known[key]))
        if rows[-1].get("outside"):
            print(
                f"{k} outside: off {rows[-1]['off']:+.1%}, stated {rows[-1]['stated']:.1%}: {table}",
                flush=True,
            )
    return rows


def summary(rows):
    """A row for each kind of stop: stated and actual errors have median and largest, their ratio median and least."""
    print("kind       scenes outside  stated          actual          ratio           not judged")
    for kind in ("none", "at rest", "gap", "preload", "all"):
        mine = [row for row in rows if kind in (row["kind"], "all")]
        good = [row for row in mine if "off" in row]
        if not good:
            continue
        off, stated = (np.array([abs(row[name]) for row in good]) for name in ("off", "stated"))
        ratio = stated / np.maximum(off, 1e-6)
        numbers = (
            f"{np.median(stated):6.2%} {stated.max():7.1%}  {np.median(off):6.2%} {off.max():7.1%}"
        )
        outside = sum(row["outside"] for row in good)
        print(
            f"{kind:10s} {len(good):5d} {outside:7d}  {numbers}  {np.median(ratio):6.2f} {ratio.min():6.2f}"
            f"  {len(mine) - len(good):10d}"
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", type=int, default=400)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path)
    options = parser.parse_args()
    found = scenes(options.scenes, options.seed, options.keep)
    summary(found)
    raise SystemExit(sum(row.get("outside", False) for row in found) > MOST)
