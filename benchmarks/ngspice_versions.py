"""One version of ngspice against another: the main job and a dozen scenes, each ngspice in a process of its own.

    .venv/bin/python benchmarks/ngspice_versions.py measure 39.json                       with the ngspice that is found
    NGSPICE_LIBRARY_PATH=libngspice.so .venv/bin/python benchmarks/ngspice_versions.py measure 46.json    another one
    .venv/bin/python benchmarks/ngspice_versions.py compare 39.json 46.json               the first one is what counts

`measure` asks for the trial of an ngspice that `harvester doctor` makes, and, of each scene with
one seed, for

- its path from rest: the displacement and the voltage, which show where two versions part
- the mean power of two trajectories with its standard error, and the main job, `make demo`'s sweep, with less of all
- ngspice's accepted steps, and processor seconds without those that compile

`compare` prints a table in Markdown and keeps it in benchmarks/results/ngspice_versions.json.  A
library named by NGSPICE_LIBRARY_PATH loads the code models of its own start file; that of a wheel
of another version has them beside it.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np
from common import report

import harvester as hv
from harvester.cosimulation.ngspice.locate_libngspice import find_library
from harvester.cosimulation.ngspice.trial import versions
from harvester.cosimulation.worker_pool import ngspice_here
from harvester.machine.provenance import versions as python_versions

EXAMPLES = Path(__file__).parents[1] / "examples"
# Kinds of load, stop and shaking: seconds of the path, and of each of the two trajectories.
SCENES = {"plate": 2.0, "plate_with_stop": 2.0, "plate_two_stops": 2.0, "plate_bistable": 2.0, "plate_coloured": 2.0,
          "plate_harmonic_stop": 2.0, "plate_bridge": 2.0, "plate_doubler": 2.0, "plate_parallel_sshi": 2.0,
          "plate_series_sshi": 2.0, "plate_sece": 1.0, "bimorph_ltc3588": 0.1}  # fmt: skip
POLYNOMIAL = "polynomial (code model)"
NETLIST = EXAMPLES.parent / "tests/support/polynomial.cir"
SEED = 3
LEAST = 1e-15  # W: less is nothing


def scenes():
    """Scenes by name with their seconds, one of them with the netlist of a polynomial."""
    for name, seconds in SCENES.items():
        yield name, hv.load(EXAMPLES / f"{name}.toml"), seconds
    yield (
        POLYNOMIAL,
        hv.load(EXAMPLES / "plate.toml").replace(load=hv.Load(netlist=str(NETLIST))),
        2.0,
    )


def timed(function, *args, **keywords):
    """What a call gives, and its processor seconds in this process."""
    begin = time.process_time()
    return function(*args, **keywords), time.process_time() - begin


def measured(name, scene, seconds):
    """What of a scene is compared; the first call compiles and is not counted."""
    path = {"engine": "spice", "duration": seconds, "seed": SEED, "from_rest": True}
    mean = {"engine": "spice", "trajectories": 2, "duration": seconds, "seed": SEED}
    try:
        hv.motion(scene, **path | {"duration": seconds / 20})
        found, of_path = timed(hv.motion, scene, **path)
        power = hv.run(scene, **mean)
    except hv.HarvesterError as error:
        return {"error": f"{type(error).__name__}: {error}"}
    kept = {what: np.asarray(getattr(found, what)).tolist() for what in ("displacement", "voltage")}
    value = power.mean_power
    return kept | {
        "power": value.value,
        "error95": value.error95,
        "steps": power.steps,
        "seconds": of_path,
    }


def main_job():
    """The sweep of `make demo`, with less of everything: mean power at each load."""
    scene = hv.load(EXAMPLES / "paper_figure3.toml")
    rows = []
    for mu in (0.01, 0.1, 1.0, 10.0):
        one = scene.replace(nondimensional=scene.nondimensional.replace(mu=mu))
        found, seconds = timed(
            hv.run, one, engine="spice", trajectories=4, duration=300.0, seed=SEED
        )
        rows.append(
            {
                "mu": mu,
                "power": found.nondimensional["mean_power"],
                "steps": found.steps,
                "seconds": seconds,
            }
        )
    return rows


def measure(file):
    """Measure the ngspice that is found, and write the file."""
    with ngspice_here():
        version, why = versions()
        made = {
            "version": version,
            "library": Path(find_library()).name,
            "trial": why,
            "versions": python_versions(),
        }
        made["scenes"] = {name: measured(name, scene, long) for name, scene, long in scenes()}
        made["main job"] = main_job()
    file.write_text(json.dumps(made))


def apart(ours, theirs):
    """The largest difference of two courses, of the largest of the first; None where there is none to compare."""
    a, b = np.array(ours), np.array(theirs)
    return float(np.abs(a - b).max() / max(np.abs(a).max(), 1e-300)) if a.shape == b.shape else None


def relative(ours, theirs):
    """The difference of two mean powers, of the first; None where the load has got nothing yet."""
    return theirs["power"] / ours["power"] - 1.0 if ours["power"] > LEAST else None


def compared(first, other):
    """A row for each scene, and for each load of the main job."""
    for name, ours in first["scenes"].items():
        theirs = other["scenes"][name]
        row = {"scene": name, "version": other["version"]}
        if "error" in theirs or "error" in ours:
            yield row | {"error": theirs.get("error") or ours["error"]}
            continue
        row |= {what: apart(ours[what], theirs[what]) for what in ("displacement", "voltage")}
        known = ours["error95"] is not None and ours["power"] > LEAST
        row |= {
            "power": relative(ours, theirs),
            "error95": ours["error95"] / ours["power"] if known else None,
        }
        yield row | {"steps": theirs["steps"] / ours["steps"]}
    for ours, theirs in zip(first["main job"], other["main job"], strict=True):
        row = {
            "scene": f"main job, mu = {ours['mu']}",
            "version": other["version"],
            "power": relative(ours, theirs),
        }
        seconds = theirs["seconds"] / theirs["steps"] / (ours["seconds"] / ours["steps"])
        yield row | {"steps": theirs["steps"] / ours["steps"], "seconds a step": seconds}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=["measure", "compare"])
    parser.add_argument("files", nargs="+", type=Path)
    given = parser.parse_args()
    if given.what == "measure":
        measure(given.files[0])
        return
    first, *others = (json.loads(file.read_text()) for file in given.files)
    rows = [row for other in others for row in compared(first, other)]
    about = [
        {key: one[key] for key in ("version", "library", "trial", "versions")}
        for one in (first, *others)
    ]
    report("ngspice_versions", rows, measured=about)


if __name__ == "__main__":
    main()
