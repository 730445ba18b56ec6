"""Engine `spice` of this checkout against that of another one: seconds for the same standard error, in one run.

Each checkout has a process of its own, which stays; both answer the same scenes with the same
seeds, in turn, after a short answer that is not counted.  Sampling leaves a variance that falls as
one over the time spent, so that the product of seconds and squared standard error says what an
accuracy costs, whichever of the two went on for longer:

    cheaper = (seconds * stderr^2) there / (seconds * stderr^2) here,    the sums over the seeds
    z       = (mean power here - there) / the standard error of their difference

The answers' means are weighted by 1/stderr^2.  Built-in netlists are each checkout's own: a switch
that has become sharper since shows as a difference of the power.

    git worktree add ../before 0b3416a
    .venv/bin/python benchmarks/against.py ../before            # the commit before control variates
    .venv/bin/python benchmarks/against.py ../before --seeds 2 "SECE"     # the other rows stay in the table
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from common import report
from compiled_circuits import USERS

HERE = Path(__file__).parents[1]
STOP = "\n[stop]\nrestitution = 0.96\n"
# name: example, its last lines, target here and there, for standard errors that are much alike
SCENES = {
    "bridge, no stop": ("plate_bridge", "", 0.01, 0.01),
    "bridge, stop": ("plate_bridge", STOP, 0.02, 0.02),
    "parallel SSHI, stop": ("plate_parallel_sshi", "", 0.02, 0.05),
    "SECE, stop": ("plate_sece", "", 0.02, 0.05),
    "own netlist, stop": ("own", STOP, 0.02, 0.02),
    "board of BAT54": ("bridge of BAT54", "", 0.01, 0.05),
    "board of BAT54, stop": ("bridge of BAT54", STOP, 0.01, 0.05),
    "board with a zener diode, stop": ("zener clamp", STOP, 0.01, 0.05),
    "board with a switch, stop": ("switch with hysteresis", STOP, 0.01, 0.05),
    "board of BAT54, 60 Hz": ("bridge of BAT54", "", 0.02, 0.05),
    "board with a zener diode, 60 Hz": ("zener clamp", "", 0.02, 0.05),
}
DEVICE_60_HZ = """
[oscillator]
mass = "5 g"
stiffness = "710.6 N/m"
damping_ratio = 0.0125

[piezo]
coupling = "8.027e-4 N/V"
capacitance = "30 nF"

[excitation]
acceleration_psd = "1e-4 g^2/Hz"

"""
PROGRAM = """
import json, sys, time
import harvester as hv
for line in sys.stdin:
    path, options = json.loads(line)
    begin = time.perf_counter()
    answer = hv.Spice(**options).run(hv.load(path))
    power = answer.mean_power
    print(json.dumps([time.perf_counter() - begin, power.value, power.stderr]), flush=True)
"""


class Checkout:
    """A process that answers by the code of one checkout, with this one's Python and libraries."""

    def __init__(self, folder):
        place = os.environ | {"PYTHONPATH": str(Path(folder).resolve())}
        program = [sys.executable, "-P", "-c", PROGRAM]
        self.process = subprocess.Popen(
            program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=place
        )

    def answer(self, path, **options):
        """Seconds, mean power in W, and its standard error, by engine `spice` with these options."""
        self.process.stdin.write(json.dumps([str(path), options]) + "\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            raise SystemExit(f"a checkout ended with status {self.process.wait()}")
        return json.loads(line)


def scene_file(folder, name):
    """The scene, written to a file that both checkouts can read."""
    example, more, *targets = SCENES[name]
    if example == "own" or example in USERS:
        netlist = Path(folder) / "own.cir"
        values = ""
        if example == "own":
            body = (
                (HERE / "examples" / "own_netlist.py")
                .read_text()
                .split('LIMITED = """')[1]
                .split('"""')[0]
            )
            values = 'parameters = { R = "1 Mohm", C = "0.2 uF" }\n'
        else:
            body = f"* {example}\n.subckt own p n\n{USERS[example]}\n.ends\n"
        netlist.write_text(body)
        plate = (HERE / "examples" / "plate_bridge.toml").read_text().split("[load]")[0]
        text = DEVICE_60_HZ if name.endswith("60 Hz") else plate
        text += f'[load]\nnetlist = "{netlist}"\n{values}'
    else:
        text = (HERE / "examples" / f"{example}.toml").read_text()
    path = Path(folder) / f"{name}.toml"
    path.write_text(text + more)
    return path, targets


def weighted(runs):
    """The mean of answers by 1/stderr^2, its standard error, and seconds times squared relative standard error."""
    weights = [1.0 / stderr**2 for _, _, stderr in runs]
    mean = sum(w * value for w, (_, value, _) in zip(weights, runs, strict=True)) / sum(weights)
    cost = (
        sum(seconds for seconds, _, _ in runs)
        * sum((stderr / mean) ** 2 for *_, stderr in runs)
        / len(runs) ** 2
    )
    return mean, sum(weights) ** -0.5, cost


def compared(name, here, there, seeds, folder):
    """One row of the table."""
    path, targets = scene_file(folder, name)
    for checkout in (here, there):
        checkout.answer(path, within=0.5, budget=60.0)
    both = list(zip((here, there), targets, strict=True))
    runs = [
        [one.answer(path, within=within, seed=seed) for one, within in both]
        for seed in range(seeds)
    ]
    ours, theirs = (list(several) for several in zip(*runs, strict=True))
    (mean, error, cost), (other, other_error, other_cost) = weighted(ours), weighted(theirs)
    row = {"scene": name, "within": targets, "seeds": seeds}
    for place, several, value in (("here", ours, mean), ("there", theirs, other)):
        row[f"seconds {place}"] = sum(one[0] for one in several) / seeds
        row[f"stderr {place}"] = sum(one[2] for one in several) / seeds / value
        row[f"power {place}, uW"] = 1e6 * value
    return row | {
        "cheaper": other_cost / cost,
        "z": (mean - other) / math.hypot(error, other_error),
    }


def main():
    """Compare the scenes that are named, all by default, and write the table when all were."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("other", help="the folder of another checkout")
    parser.add_argument("scene", nargs="*", help="names of scenes, or parts of them; default: all")
    parser.add_argument("--seeds", type=int, default=4)
    options = parser.parse_intermixed_args()
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"],
        cwd=options.other,
        capture_output=True,
        text=True,
        check=True,
    )
    asked = [
        name for name in SCENES if not options.scene or any(part in name for part in options.scene)
    ]
    here = Checkout(HERE)
    there = Checkout(options.other)
    results = Path(__file__).parent / "results" / "against.json"
    rows = (
        {one["scene"]: one for one in json.loads(results.read_text())["rows"]}
        if results.exists()
        else {}
    )
    with tempfile.TemporaryDirectory() as folder:
        for name in asked:
            rows[name] = compared(name, here, there, options.seeds, folder)
    for checkout in (here, there):
        checkout.process.communicate()
    report("against", [rows[name] for name in SCENES if name in rows], there=commit.stdout.strip())


if __name__ == "__main__":
    main()
