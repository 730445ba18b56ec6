"""Thirty scenes of several features by three targets: reached or not, in which seconds, and by which engine.

    python benchmarks/asked.py [scenes|predictions|coverage|by_hand] [--budget 10] [--scene NAME ...]
    ... coverage|by_hand [--within 0.01] [--seeds 30]

`scenes` reports for each scene and target whether `hv.Cheapest` reaches it in the budget, the engine,
the stated error, and seconds of the wall and of all processes together (``busy``).  A run that is not
counted compiles before.  ``early`` is an answer beyond the target with a quarter of the budget left
and no engine named that would do. `predictions` gives each scene that took a second and more a third of
that, and compares the seconds that its answer then says are enough with those that a run takes which
has them.  `coverage` counts answers of seeds whose total error includes a reference of `density`.
"""

import argparse
import contextlib
import dataclasses
import io
import json
import os
import statistics
import time
from pathlib import Path

from common import report
from targets import busy

import harvester as hv
from harvester.engines.selection import ENGINES, serving
from harvester.errors import HarvesterError
from harvester.presentation.diagnostic import has

EXAMPLES = Path(__file__).parents[1] / "examples"
TARGETS = (0.01, 0.1, 0.002)
MOST = 1.5  # times the budget
LONGEST = 60.0  # s: of a prediction that is tried
SHORTEST = 1.0  # s of CPU time, from which on a prediction is asked for
BY_HAND = 1.5  # times the seconds of the best engine chosen by hand
ROUNDING = 0.1  # s: of shorter answers, a difference that nobody waits for
REFEREE = 1e-3  # relative error of a reference
SEEDS = 30
OUT_OF_REACH = ("within_record_join",)  # warnings that no effort reaches the target

PLATE = {
    "oscillator": {"mass": "40 g", "stiffness": "16 N/m", "damping": "6.4e-3 N s/m"},
    "piezo": {"coupling": "1e-3 N/V", "capacitance": "50.2 nF"},
    "excitation": {"acceleration_psd": "1e-5 g^2/Hz"},
    "load": {"resistance": "1 Mohm"},
}
BIMORPH = {
    "oscillator": {"mass": "16.542 g", "stiffness": "1364.1 N/m", "damping_ratio": 0.027},
    "piezo": {"coupling": "2.5261e-3 N/V", "capacitance": "41.259 nF"},
    "excitation": {"acceleration_amplitude": "0.2 g", "frequency": "47 Hz"},
    "load": {"resistance": "40 kohm"},
}
BEAM = {
    "oscillator": {"mass": "8 g", "frequency": "60 Hz", "damping_ratio": 0.012},
    "piezo": {"coupling": "1.5e-3 N/V", "capacitance": "40 nF"},
    "mode": [
        {
            "frequency": "350 Hz",
            "mass": "9 g",
            "damping_ratio": 0.012,
            "coupling": "-4e-3 N/V",
            "base": -0.5,
        }
    ],
    "excitation": {"acceleration_psd": "2e-4 g^2/Hz"},
    "load": {"resistance": "120 kohm"},
}
SINE = {"acceleration_amplitude": "0.03 g", "frequency": "3.4 Hz"}
NOISE = {"acceleration_psd": "3e-3 g^2/Hz"}
BALL = {"mass": "5 g", "room": "2 mm", "restitution": 0.8}
# the device, and the tables in its place; keys of those that are left are added
SCENES = {
    "linear": (PLATE, {"load": {"resistance": "300 kohm"}}),
    "stop at rest": (PLATE, {"stop": {"restitution": 0.75}}),
    "stop at a distance": (PLATE, {"stop": {"restitution": 0.85, "gap": "0.15 mm"}}),
    "preload": (PLATE, {"stop": {"restitution": 0.8, "gap": "-0.05 mm"}}),
    "two stops": (
        PLATE,
        {
            "stop": {"restitution": 0.8, "gap": "0.2 mm"},
            "opposite_stop": {"restitution": 0.6, "gap": "0.25 mm"},
        },
    ),
    "compliant stop": (
        PLATE,
        {"stop": {"gap": "0.1 mm", "stiffness": "2 kN/m", "damping": "2 N s/m"}},
    ),
    "bistable": (PLATE, {"oscillator": {"stiffness": "-16 N/m", "cubic_stiffness": "3e8 N/m^3"}}),
    "hard spring": (
        PLATE,
        {
            "oscillator": {"cubic_stiffness": "2e8 N/m^3", "damping_v": 0.5},
            "load": {"resistance": "3 Mohm"},
        },
    ),
    "parametric": (
        PLATE,
        {
            "excitation": {"acceleration_psd": "1e-5 g^2/Hz", "stiffness_noise": 0.003},
            "stop": {"restitution": 0.8},
        },
    ),
    "coloured, stop": (
        PLATE,
        {
            "excitation": {"acceleration_psd": "2e-5 g^2/Hz", "correlation_time": "40 ms"},
            "stop": {"restitution": 0.9, "gap": "0.1 mm"},
        },
    ),
    "band, two stops": (
        PLATE,
        {
            "excitation": {
                "acceleration_psd": "2e-5 g^2/Hz",
                "centre_frequency": "4 Hz",
                "bandwidth": "0.6 Hz",
            },
            "stop": {"restitution": 0.9, "gap": "0.2 mm"},
            "opposite_stop": {"restitution": 0.9, "gap": "0.2 mm"},
        },
    ),
    "record, stop": (
        PLATE,
        {
            "excitation": {"acceleration_file": str(EXAMPLES / "shake.csv")},
            "stop": {"restitution": 0.8, "gap": "0.3 mm"},
        },
    ),
    "shocks": (
        PLATE,
        {
            "excitation": {
                "profile": "half-sine-shock",
                "acceleration_amplitude": "0.5 g",
                "pulse_duration": "20 ms",
                "event_rate": "0.3 Hz",
            },
            "stop": {"restitution": 0.7, "gap": "1 mm"},
        },
    ),
    "two modes": (BEAM, {}),
    "two modes, stop": (BEAM, {"stop": {"restitution": 0.8, "gap": "0.04 mm"}}),
    "ball": (PLATE, {"ball": BALL, "excitation": {"acceleration_psd": "1e-4 g^2/Hz"}}),
    "tilted ball": (BIMORPH, {"ball": BALL | {"tilt": 10.0, "mass": "2 g"}, "excitation": NOISE}),
    "sine": (PLATE, {"excitation": SINE}),
    "sine, stop": (PLATE, {"excitation": SINE, "stop": {"restitution": 0.85, "gap": "0.4 mm"}}),
    "sine, bistable": (
        BIMORPH,
        {
            "oscillator": {
                "mass": "22 g",
                "stiffness": "-63.451 N/m",
                "cubic_stiffness": 634509.0,
                "damping": "0.125 N s/m",
                "damping_ratio": None,
            },
            "excitation": {"acceleration_amplitude": "9 m/s^2", "frequency": "9 Hz"},
        },
    ),
    "two modes, bridge": (
        BEAM,
        {"load": {"netlist": "bridge", "parameters": {"R": "400 kohm", "C": "0.3 uF"}}},
    ),
    "stop, bridge": (
        PLATE,
        {
            "stop": {"restitution": 0.8, "gap": "0.2 mm"},
            "load": {"netlist": "bridge", "parameters": {"R": "1 Mohm", "C": "0.5 uF"}},
        },
    ),
    "ball, doubler": (
        PLATE,
        {
            "ball": BALL,
            "excitation": {"acceleration_psd": "1e-4 g^2/Hz"},
            "load": {"netlist": "doubler", "parameters": {"R": "5 Mohm", "C": "0.5 uF"}},
        },
    ),
    "sine, SSHC": (
        BIMORPH,
        {"load": {"netlist": "sshc", "parameters": {"R": "140 kohm", "C": "0.5 uF"}}},
    ),
    "series SSHI": (
        PLATE,
        {
            "load": {
                "netlist": "series_sshi",
                "parameters": {
                    "R": "4 Mohm",
                    "C": "0.3 uF",
                    "L": "2 H",
                    "Rcoil": "1.2 kohm",
                    "Rcore": "500 kohm",
                },
            }
        },
    ),
    "SECE, stop": (
        PLATE,
        {
            "stop": {"restitution": 0.9},
            "load": {"netlist": "sece", "parameters": {"R": "2 Mohm", "C": "0.5 uF"}},
        },
    ),
    "self-powered SSHI": (
        BIMORPH,
        {
            "excitation": NOISE,
            "load": {
                "netlist": "self_powered_sshi",
                "parameters": {"R": "300 kohm", "C": "0.2 uF"},
            },
        },
    ),
    "board": (
        BIMORPH,
        {
            "excitation": NOISE,
            "load": {
                "netlist": str(EXAMPLES / "board.cir"),
                "terminals": ["/PZ_P", "/PZ_N"],
                "resistor": "R4",
                "store": "C1",
                "supplies": {"VCC": "3 V"},
            },
        },
    ),
    "chip ltc3588": (
        BIMORPH,
        {
            "excitation": {"acceleration_amplitude": "0.2 g", "frequency": "46 Hz"},
            "load": {
                "netlist": "ltc3588",
                "parameters": {"R": "20 kohm", "C": "22 uF", "Cout": "10 uF"},
            },
        },
    ),
    "record, bridge": (
        PLATE,
        {
            "excitation": {"acceleration_file": str(EXAMPLES / "shake.csv")},
            "load": {"netlist": "bridge", "parameters": {"R": "1.5 Mohm", "C": "1 uF"}},
        },
    ),
}
REFERENCED = (
    "stop at rest",
    "stop at a distance",
    "preload",
    "two stops",
    "parametric",
    "bistable",
)


def scene(name):
    """A scene of the table, by its tables as in a file."""
    device, changed = SCENES[name]
    tables = {}
    for key in {**device, **changed}:
        mine = changed.get(key, device.get(key))
        if key == "oscillator":
            mine = {**device[key], **changed.get(key, {})}
        if isinstance(mine, dict):
            mine = {name: value for name, value in mine.items() if value is not None}
        tables[key] = mine
    return hv.Scene(**tables)


def asked(name, within, budget, seed=0, kind=hv.Cheapest):
    """The answer of the chooser, or of another engine, or its refusal, and the seconds that it took."""
    begin = time.perf_counter()
    before = busy()
    options = {"within": within, "budget": budget, "seed": seed}
    known = {field.name for field in dataclasses.fields(kind)}
    try:
        found = kind(**{key: options[key] for key in options if key in known}).run(scene(name))
        refused = None
    except HarvesterError as error:
        found = None
        refused = str(error)
    spent = {"wall": time.perf_counter() - begin, "busy": busy() - before}
    return found, spent | {"refused": refused}


def stated(found):
    """The relative error of an answer's power, or None if a part is not known."""
    power = found.mean_power
    return None if power.error95 is None else power.known_error95 / abs(power.value)


def enough(found):
    """The seconds that an answer says its engine or another would need in all, or None."""
    seconds = [
        value
        for said in found.diagnostics
        for key, value in said.numbers.items()
        if value and (key == "enough" or key.startswith("needed_"))
    ]
    return min(seconds, default=None)


def row_of(name, within, budget):
    """The row of a scene and a target."""
    found, row = asked(name, within, budget)
    row = {"scene": name, "within": within, "budget": budget} | row
    row["in time"] = row["wall"] <= MOST * budget
    row["load"] = os.getloadavg()[0]
    if found is None:
        return row | {"outcome": "refused"}
    error = stated(found)
    needs = enough(found)
    row |= {"engine": found.engine, "error": error, "power": found.mean_power.value}
    row |= {"needs": needs, "said": [str(said) for said in found.diagnostics][:6]}
    if error is not None and error <= within:
        return row | {"outcome": "reached"}
    barred = has(found.diagnostics, *OUT_OF_REACH)
    early = row["wall"] < 0.75 * budget and needs is None and not barred
    return row | {"outcome": "early" if early else "missed"}


def scenes(options):
    """All scenes by all targets."""
    rows = []
    for within in TARGETS:
        for name in options.scene or SCENES:
            asked(name, 0.3, 1.0)
            rows.append(row_of(name, within, options.budget))
            print({key: value for key, value in rows[-1].items() if key != "said"}, flush=True)
            kept("asked", rows, options)
    print(summary(rows))


def summary(rows):
    """How many rows have each outcome, by target."""
    lines = []
    for within in TARGETS:
        mine = [row for row in rows if row["within"] == within]
        counted = {
            outcome: sum(row["outcome"] == outcome for row in mine)
            for outcome in ("reached", "missed", "early", "refused")
        }
        late = [row["scene"] for row in mine if not row["in time"]]
        lines.append(f"{within:.1%}: {counted}, late: {late}")
    return "\n".join(lines)


def predictions(options):
    """The seconds that a run with a third of its time predicts, against those of one that has them."""
    known = json.loads((Path(__file__).parent / "results" / "asked.json").read_text())["rows"]
    rows = []
    for before in known:
        name, within = before["scene"], before["within"]
        reached = before["outcome"] == "reached" and before["busy"] > SHORTEST
        if not (
            reached or (before["outcome"] == "missed" and (before["needs"] or LONGEST) < LONGEST)
        ):
            continue
        part = max(before["busy"] / 3.0, 0.5) if reached else options.budget
        asked(name, 0.3, 1.0)
        found, first = asked(name, within, part)
        if found is None or (needs := enough(found)) is None or needs > LONGEST:
            continue
        found, row = asked(name, within, 3.0 * needs)
        if found is None:
            continue
        error = stated(found)
        row = {"scene": name, "within": within, "part": part, "part busy": first["busy"]} | row
        row |= {"needs": needs, "error": error, "engine": found.engine}
        row["ratio"] = row["wall"] / needs
        rows.append(row)
        print(rows[-1], flush=True)
        kept("asked_predictions", rows, options)
    good = [row for row in rows if 0.5 <= row["ratio"] <= 2.0]
    print(f"{len(good)} of {len(rows)} within a factor of 2")


def by_hand(options):
    """The seconds of the chooser against those of the fastest engine that reaches the target."""
    rows = []
    for name in options.scene or SCENES:
        kinds = [ENGINES[each] for each in serving(scene(name))]
        for kind in kinds:  # compiles
            asked(name, 0.3, 1.0, kind=kind)
        found, row = asked(name, options.within, options.budget)
        took = {}
        for kind in kinds:
            other, spent = asked(name, options.within, options.budget, kind=kind)
            error = None if other is None else stated(other)
            if error is not None and error <= options.within:
                took[kind.NAME] = spent["wall"]
        best = min(took, key=took.get, default=None)
        row = {"scene": name, "within": options.within} | row
        row |= {"engine": None if found is None else found.engine, "by hand": took, "best": best}
        if best is not None:
            row["ratio"] = (row["wall"] + ROUNDING) / (took[best] + ROUNDING)
        rows.append(row)
        print(rows[-1], flush=True)
        kept("asked_by_hand", rows, options)
    known = [row["ratio"] for row in rows if "ratio" in row]
    print(
        f"{sum(ratio <= BY_HAND for ratio in known)} of {len(known)} at most {BY_HAND} times as long"
    )


def coverage(options):
    """Answers of seeds whose total error includes the reference."""
    rows = []
    for name in options.scene or REFERENCED:
        reference = hv.Density(within=REFEREE, budget=120.0).run(scene(name)).mean_power
        engines = set()
        inside = 0
        scores = []
        took = []
        for seed in range(options.seeds):
            found, row = asked(name, options.within, options.budget, seed)
            power = found.mean_power
            engines.add(found.engine)
            off = abs(power.value - reference.value)
            inside += off <= power.known_error95 + (reference.bias or 0.0)
            scores.append(off / power.known_error95)
            took.append(row["busy"])
        row = {"scene": name, "within": options.within, "engines": sorted(engines)}
        row |= {"seeds": options.seeds, "inside": inside}
        row |= {"median of off by stated": statistics.median(scores), "most": max(scores)}
        rows.append(row | {"busy": statistics.median(took)})
        print(rows[-1], flush=True)
        kept("asked_coverage", rows, options)


def kept(name, rows, options):
    """Write the rows without printing all of them."""
    with contextlib.redirect_stdout(io.StringIO()):
        report(name, rows, ("PySpice",), options=vars(options), load=os.getloadavg()[0])


def main():
    """One of the four parts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "part",
        choices=("scenes", "predictions", "coverage", "by_hand"),
        default="scenes",
        nargs="?",
    )
    parser.add_argument("--budget", type=float, default=10.0)
    parser.add_argument("--scene", action="append")
    parser.add_argument(
        "--within", type=float, default=0.01, help="target of `coverage` and `by_hand`"
    )
    parser.add_argument("--seeds", type=int, default=SEEDS, help="answers of `coverage`")
    options = parser.parse_args()
    parts = {"scenes": scenes, "predictions": predictions, "coverage": coverage, "by_hand": by_hand}
    parts[options.part](options)


if __name__ == "__main__":
    main()
