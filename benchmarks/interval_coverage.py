"""Whether 95 % intervals hold what they state: the share of many seeds inside, scene by scene, with its own interval.

Each scene is run with many seeds, as a user would with `--within`.  Three shares are counted.

    sampling   inside their 95 % of sampling of the mean of all the other seeds: near 0.95 if the spread is honest
    whole      inside their `error95` of a reference of other seeds, at a fifth of the target: 0.95 or more, because the
               bias of the step is added in full.  For ngspice the reference is a mean of runs at half the step and a
               tenth of the tolerance, where `--references` asks for it; for a custom board that of engine `compiled`.
    target     within `--within` of that reference, of the answers that came without a word on a target that was missed

    .venv/bin/python benchmarks/interval_coverage.py --seeds 200
    HARVESTER_THREADS=1 .venv/bin/python benchmarks/interval_coverage.py spice --seeds 100 --references 8 --most 600
    .venv/bin/python benchmarks/interval_coverage.py board --seeds 40

Names are scenes or parts of them.  Every answer is kept in out/interval_coverage.jsonl at once, and
one that is there is not computed again: delete it after a change of the engines.  Rows of scenes
that are not run stay in the table. The interval of a share is Wilson's, at 95 %.
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
from compiled_circuits import USERS

import harvester as hv

EXAMPLES = Path(__file__).parents[1] / "examples"
ND = {
    "alpha": 0.5,
    "beta": 0.05,
    "mu": 0.05,
    "c1": 0.01,
    "c2": 0.05,
    "c3": 0.1,
    "D11": 0.01,
    "D22": 0.01,
}
JOURNAL = Path(__file__).parents[1] / "out" / "interval_coverage.jsonl"
OTHERS = 6  # seeds of a reference
BOARDS = "bridge of BAT54", "zener clamp", "switch with hysteresis"
STOP = hv.Stop(restitution=0.96)
DENSITY = str(EXAMPLES / "shake_psd.csv")


def nondimensional(**changed):
    """The paper's scene with some keys changed, None: left out."""
    return hv.Scene(
        nondimensional=hv.Nondimensional(
            **{k: v for k, v in (ND | changed).items() if v is not None}
        )
    )


def example(name, **changed):
    """An example with some tables changed."""
    return dataclasses.replace(hv.load(EXAMPLES / f"{name}.toml"), **changed)


def own_netlist(folder):
    """The bridge with a Zener diode of examples/own_netlist.py."""
    text = (EXAMPLES / "own_netlist.py").read_text().split('LIMITED = """')[1].split('"""')[0]
    path = Path(folder) / "limited.cir"
    path.write_text(text)
    load = hv.Load(netlist=str(path), parameters={"R": "1 Mohm", "C": "0.2 uF"})
    return example("plate_bridge", load=load, stop=STOP)


def boards(folder):
    """As `scenes`: boards of a user's own, with a stop and without, at a loose target, for many seeds."""
    for name in BOARDS:
        path = Path(folder) / f"{name.replace(' ', '_')}.cir"
        path.write_text(f"* {name}\n.subckt board p n\n{USERS[name]}\n.ends\n")
        scene = example("plate_bridge").with_load(netlist=str(path))
        yield f"board: {name}", scene, hv.Spice, 0.05
        yield f"board: {name}, stop", dataclasses.replace(scene, stop=STOP), hv.Spice, 0.05


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
        "tabulated noise, stop": example(
            "plate_with_stop", excitation=hv.Excitation(acceleration_psd_file=DENSITY)
        ),
    }
    for name, scene in sampled.items():
        yield name, scene, hv.Ensemble, 0.01
    yield "bridge, stop (ideal)", example("plate_bridge", stop=STOP), hv.Ideal, 0.01
    yield "resistor, stop (spice)", example("plate_with_stop"), hv.Spice, 0.02
    yield "bridge, stop (spice)", example("plate_bridge", stop=STOP), hv.Spice, 0.02
    yield "parallel SSHI, stop (spice)", example("plate_parallel_sshi"), hv.Spice, 0.02
    yield "own netlist, stop (spice)", own_netlist(folder), hv.Spice, 0.02
    yield from boards(folder)


def wilson(inside, count):
    """The 95 % interval of a share."""
    z = 1.96
    share = inside / count
    centre = share + z * z / (2 * count)
    width = z * math.sqrt(share * (1 - share) / count + (z / (2 * count)) ** 2)
    return [(centre + sign * width) / (1 + z * z / count) for sign in (-1, 1)]


class Journal:
    """The answers of one scene, by seed; None: with the settings of the reference."""

    def __init__(self, name, within):
        self.place = {"scene": name, "within": within}
        self.known = {}
        for line in JOURNAL.read_text().splitlines() if JOURNAL.exists() else ():
            one = json.loads(line)
            if self.place.items() <= one.items():
                self.known[one["seed"], one["what"]] = one

    def answer(self, scene, engine, seed, what="", **options):
        """What the engine answers with a seed, computed or known; ``what`` says in which settings."""
        if (found := self.known.get((seed, what))) is None:
            begin, busy = time.perf_counter(), time.process_time()
            answer = engine(seed=seed, **options).run(scene)
            power = answer.mean_power
            found = self.place | {
                "seed": seed,
                "what": what,
                "value": power.value,
                "stderr": power.stderr,
            }
            found |= {
                "sampling95": power.sampling95,
                "error95": power.known_error95,
                "whole": power.error95 is not None,
            }
            found |= {
                "missed": any("within" in one.numbers for one in answer.warnings),
                "step": answer.details["step"],
            }
            found |= {
                "seconds": time.perf_counter() - begin,
                "process seconds": time.process_time() - busy,
            }
            JOURNAL.parent.mkdir(exist_ok=True)
            with JOURNAL.open("a") as file:
                file.write(json.dumps(found) + "\n")
            self.known[seed, what] = found
        return found


def reference(journal, scene, engine, within, several):
    """The mean power and its standard error, of other seeds, and at a finer step; None for ngspice without several."""
    is_board = "board" in journal.place["scene"]
    if engine is not hv.Spice or is_board:
        others = range(1_000_000, 1_000_000 + OTHERS)
        judge = hv.Compiled if is_board else engine
        powers = [
            journal.answer(scene, judge, seed, "reference", within=within / 5.0) for seed in others
        ]
        error = math.hypot(*(one["stderr"] or 0.0 for one in powers)) / OTHERS
    elif several > 1:
        step = journal.answer(scene, engine, 0, within=within)["step"]
        finer = {"dt": 0.5 * step, "reltol": 1e-5, "within": within, "trajectories": 8}
        others = range(1_000_000, 1_000_000 + several)
        powers = [journal.answer(scene, engine, seed, "reference", **finer) for seed in others]
        error = float(np.std([one["value"] for one in powers], ddof=1) / math.sqrt(several))
    else:
        return None
    return float(np.mean([one["value"] for one in powers])), error


def share(name, inside, count):
    """How many of how many, in a row of the table."""
    return {f"{name} inside": inside / count, f"{name} interval": wilson(inside, count)}


def measured(name, scene, engine, within, options):
    """One row of the table."""
    begin = time.perf_counter()
    answers = []
    journal = Journal(name, within)
    for seed in range(options.seeds):
        answers.append(journal.answer(scene, engine, seed, within=within))
        if time.perf_counter() - begin > options.most:
            break
    several = {
        key: np.array([one[key] for one in answers])
        for key in ("value", "sampling95", "error95", "stderr")
    }
    values = several["value"]
    count = len(answers)
    others = (values.sum() - values) / (count - 1)
    row = {"scene": name, "within": within, "seeds": count}
    row |= {
        key: float(np.mean([one[key] for one in answers])) for key in ("seconds", "process seconds")
    }
    row |= {"spread": float(values.std(ddof=1) / values.mean())}
    row |= {"stated": float(several["stderr"].mean() / values.mean())}
    row |= {"stated 95": float(several["error95"].mean() / values.mean())}
    row |= share("sampling", int((abs(values - others) <= several["sampling95"]).sum()), count)
    row["whole error known"] = sum(one["whole"] for one in answers) / count
    known = reference(journal, scene, engine, within, options.references)
    if known is not None:
        truth, error = known
        row |= {
            "reference": truth,
            "reference stderr": error,
            "bias seen": float(values.mean() / truth - 1.0),
        }
        row |= share("whole", int((abs(values - truth) <= several["error95"]).sum()), count)
        reached = values[[not one["missed"] for one in answers]]
        row["reached"] = len(reached)
        if len(reached):
            row |= share(
                "target", int((abs(reached - truth) <= within * truth).sum()), len(reached)
            )
    return row


def main():
    """Measure the scenes that are named, all by default, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="*", help="names of scenes, or parts of them; default: all")
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument(
        "--references", type=int, default=0, help="runs of ngspice that make its reference"
    )
    parser.add_argument(
        "--most",
        type=float,
        default=1e9,
        help="seconds a scene, after which no further seed is run",
    )
    options = parser.parse_args()
    results = Path(__file__).parent / "results" / "interval_coverage.json"
    rows = (
        {one["scene"]: one for one in json.loads(results.read_text())["rows"]}
        if results.exists()
        else {}
    )
    with tempfile.TemporaryDirectory() as folder:
        every = {name: (name, *more) for name, *more in scenes(folder)}
        asked = [
            name
            for name in every
            if not options.scene or any(part in name for part in options.scene)
        ]
        for name in asked:
            rows[name] = measured(*every[name], options)
            report("interval_coverage", [rows[one] for one in every if one in rows])


if __name__ == "__main__":
    main()
