"""Circuits times shakings times springs and stops: what `spice` and `ideal` answer, beside a converged reference.

The device is a measured bimorph (Erturk and Inman, Smart Mater. Struct. 18, 025009, 2009).  Under a
sinusoid and under a record the reference is ngspice alone with the whole device as one netlist
(`folded_device.py`): at two longest steps, whose difference is its doubt, with the scatter of long
windows where the response does not come back. Under coloured noise it is `spice` with other noise,
at a quarter of the step and a hundredth of the tolerance; for the circuits that switch, at half of
the step and a tenth of the tolerance.

    python benchmarks/products.py                # those not yet in results/products.json; ^C loses nothing
    python benchmarks/products.py harmonic gap   # those whose name has all these words, anew
    python benchmarks/products.py --check gap    # `spice` anew beside the references that are kept: 1 where one is off
"""

import contextlib
import itertools
import json
import math
import sys
import tempfile
import time
from datetime import date
from pathlib import Path

import numpy as np
from common import COIL, report
from folded_device import powers

import harvester as hv
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError

CIRCUITS = {  # netlist's parameters beside R and C = `SMOOTHED`/R
    "resistor": {"R": 35e3},
    "bridge": {"R": 7e4},
    "doubler": {"R": 2.5e5},
    "parallel_sshi": {"R": 7e4} | COIL,
    "series_sshi": {"R": 1e5} | COIL,
    "sece": {"R": 1e5},
    "sshc": {"R": 7e4},
    "self_powered_sshi": {"R": 7e4},
    "ltc3588": {"R": 24e3, "C": 2.2e-6, "Cout": 1e-6},
    "bq25570": {"R": 1e5, "C": 1e-6, "Cin": 1e-7, "Cout": 1e-6, "every": 0.25, "look": 0.05},
    "own": {"R": 7e4},
}
OWN = """* A bridge of Schottky diodes and a diode that limits its voltage
.subckt own p n R=70k C=1u
D1 p a BAT54
D2 n a BAT54
D3 b p BAT54
D4 b n BAT54
.model limit D(Is=1p N=1 Rs=10 Bv=12 Ibv=10u)
Dlimit b a limit
Csmooth a b {C}
Rload a b {R}
.ends own
"""
SMOOTHED = 0.02  # s: load times smoothing capacitance
DEVICE = {"mass": 16.542e-3, "stiffness": 1364.1, "damping": 0.25652}
WELL = 5e-4  # m from the top between two wells to each of their bottoms
# the oscillator's and stop's keys, the frequency (Hz) and amplitude (g) of the sinusoid
SPRINGS = {
    "free": ({}, {}, 46.0, 0.25),
    "stop": ({}, {"restitution": 0.8}, 90.0, 0.5),
    "gap": ({}, {"restitution": 0.8, "gap": 2e-4}, 50.0, 0.4),
    "bistable": ({"stiffness": -682.05, "cubic_stiffness": 682.05 / WELL**2}, {}, 40.0, 0.25),
}
SHAKINGS = ("harmonic", "recorded", "coloured")
RECORD = 0.5, 1000.0, (30.0, 80.0), 0.4  # s, samples/s, Hz from and to, g rms
NOISE = 'acceleration_psd = "4e-3 g^2/Hz"\ncorrelation_time = "3 ms"'
PERIOD = 1.0 / 46.0  # s, of the free device
SETTLING = 60  # such periods from rest
STEPS = 1024, 2048  # of ngspice alone, in such a period; twice as many with a stop
TOLERANCES = 1e-6, 1e-5, 1e-4  # the first that ngspice alone bears
CHIPS = "ltc3588", "bq25570"  # minutes for each second: under a sinusoid only
# hundreds of steps at each switching
SWITCHED = "parallel_sshi", "series_sshi", "sece", "sshc", "self_powered_sshi"
# of `spice`
BUDGETS = {"harmonic": {}, "recorded": {"budget": "150s"}, "coloured": {"budget": "20s"}}
TOWARDS = {"within": "5%", "budget": "60s"}  # of a circuit that switches, under coloured noise
# of the reference under coloured noise: of `spice`, of the step, tolerance
FINE = {"budget": "40s"}, 4.0, 1e-6
FINER_TOWARDS = {"within": "3%", "budget": "180s"}, 2.0, 1e-5
WINDOWS = {"harmonic": 8, "recorded": 4}  # turns of the reference that are compared
RESULTS = Path(__file__).parent / "results" / "products.json"


def scene_of(circuit, shaking, spring, folder):
    """The scene of a product; its record and its own netlist are written to the folder."""
    springs, stop, frequency, level = SPRINGS[spring]
    oscillator = DEVICE | springs
    parameters = {"C": SMOOTHED / CIRCUITS[circuit]["R"]} | CIRCUITS[circuit]
    if circuit == "resistor":
        del parameters["C"]
    netlist = circuit
    if circuit == "own":
        netlist = str(folder / "own.cir")
        Path(netlist).write_text(OWN)
    if shaking == "harmonic":
        excitation = f'acceleration_amplitude = "{level} g"\nfrequency = {frequency}'
    elif shaking == "recorded":
        (folder / "shake.csv").write_text(recording())
        excitation = f'acceleration_file = "{folder / "shake.csv"}"'
    else:
        excitation = NOISE
    text = ["[oscillator]", *(f"{key} = {value!r}" for key, value in oscillator.items())]
    text += [
        "[piezo]",
        "coupling = 2.5261e-3",
        "capacitance = 41.259e-9",
        "[excitation]",
        excitation,
    ]
    text += ["[stop]", *(f"{key} = {value!r}" for key, value in stop.items())] if stop else []
    given = ", ".join(f"{key} = {value!r}" for key, value in parameters.items())
    text += ["[load]", f'netlist = "{netlist}"', f"parameters = {{ {given} }}"]
    path = folder / "scene.toml"
    path.write_text("\n".join(text) + "\n")
    return hv.load(path)


def recording():
    """A record that begins and ends at rest: lines of random phase in a band."""
    duration, rate, (low, high), rms = RECORD
    t = np.arange(round(duration * rate)) / rate
    lines = np.arange(math.ceil(low * duration), math.floor(high * duration) + 1) / duration
    phases = np.random.default_rng(5).uniform(0.0, 2.0 * math.pi, len(lines))
    a = np.cos(2.0 * math.pi * np.outer(t, lines) + phases).sum(axis=1)
    a *= np.sin(math.pi * t / duration) ** 2
    a *= rms / math.sqrt(np.mean(a**2))
    return "time (s),acceleration (g)\n" + "".join(
        f"{u:.6f},{v:.8f}\n" for u, v in zip(t, a, strict=True)
    )


def reference(scene, shaking):
    """Mean power of ngspice alone (W), its doubt at 95 %, and its tolerance."""
    problem = Problem(scene)
    turn = (
        problem.equations.record.period / problem.scales.frequency
        if shaking == "recorded"
        else 2.0 / scene.excitation.frequency
    )
    settle = turn * math.ceil(SETTLING * PERIOD / turn)
    for reltol in TOLERANCES:
        try:
            rough, small = (PERIOD / steps / (1 if scene.stop is None else 2) for steps in STEPS)
            coarse, fine = (
                powers(problem, settle, WINDOWS[shaking], turn, step, reltol, 300.0)
                for step in (rough, small)
            )
        except RuntimeError as error:
            failure = error
            continue
        if np.ptp(fine) > 1e-3 * abs(fine.mean()):  # it does not come back, at least not so soon
            windows = 10 if shaking == "recorded" else 200
            fine = powers(problem, settle, windows, turn, rough, reltol, 400.0)
            batches = fine.reshape(10, -1).mean(axis=1)
            return float(fine.mean()), 2.26 * float(batches.std(ddof=1)) / math.sqrt(10.0), reltol
        doubt = 2.0 * abs(float(fine.mean() - coarse.mean())) + float(np.ptp(fine)) / len(fine)
        better = float(fine.mean() + (fine.mean() - coarse.mean()) / 3.0)
        return better, doubt + 1e-5 * abs(better), reltol
    raise failure


def efforts(circuit, shaking):
    """How much `spice` does for a product, and how much its reference under coloured noise."""
    if shaking == "coloured" and circuit in SWITCHED:
        return TOWARDS, FINER_TOWARDS
    return BUDGETS[shaking], FINE


def fine_spice(scene, rough, effort, part, reltol):
    """The same of engine `spice` with other noise, at a part of the step and a smaller tolerance."""
    answer = hv.Spice(seed=7, dt=rough.details["step"] / part, reltol=reltol, **effort).run(scene)
    if "ledger_residual" not in answer.details:
        raise RuntimeError(f"no ngspice in the reference: {answer.warnings}")
    return answer.mean_power.value, answer.mean_power.known_error95, reltol


def told(answer):
    """What is kept of an answer."""
    power = answer.mean_power
    return {
        "mW": 1e3 * power.value,
        "stated": 1e3 * power.known_error95,
        "unknown": power.unknown,
        "parts": [power.stderr and 1e3 * power.stderr, power.bias and 1e3 * power.bias],
        "seconds": round(answer.seconds, 2),
        "warnings": list(answer.warnings),
        "note": answer.reason,
        "responses": [
            [1e3 * one.mean_power.value, one.share, one.periods] for one in answer.responses
        ],
        "periods": answer.details.get("response_periods"),
        "residual": answer.details.get("ledger_residual"),
    }


def measured(circuit, shaking, spring):
    """The row of a product."""
    row = {"product": f"{circuit} {shaking} {spring}"}
    effort, finer = efforts(circuit, shaking)
    with tempfile.TemporaryDirectory() as folder:
        scene = scene_of(circuit, shaking, spring, Path(folder))
        answers = {}
        for name, engine in {"spice": hv.Spice, "ideal": hv.Ideal}.items():
            if name == "ideal" and circuit not in (
                "bridge",
                "doubler",
                "parallel_sshi",
                "series_sshi",
                "sece",
            ):
                continue
            begin = time.perf_counter()
            try:
                answers[name] = engine(**(effort if name == "spice" else {})).run(scene)
                row[name] = told(answers[name])
            except HarvesterError as error:
                row[name] = {"failed": f"{type(error).__name__}: {error}"}
            row[name]["wall"] = round(time.perf_counter() - begin, 1)
        begin = time.perf_counter()
        try:
            of = (
                fine_spice(scene, answers["spice"], *finer)
                if shaking == "coloured"
                else reference(scene, shaking)
            )
            found = 1e3 * of[0], 1e3 * of[1], of[2]
            row["reference"] = dict(zip(("mW", "doubt", "reltol"), found, strict=True))
            for name in answers:
                row[name]["ratio"] = judged(row[name], row["reference"])
        except (RuntimeError, KeyError, HarvesterError) as error:
            row["reference"] = {"failed": str(error)[-300:]}
        row["reference"]["wall"] = round(time.perf_counter() - begin, 1)
    return row | {"date": date.today().isoformat()}


def judged(answer, reference):
    """How far the answer is off, over what it and the reference state: above 1 is one too sure of itself."""
    stated = answer["stated"] + reference["doubt"]
    return abs(answer["mW"] - reference["mW"]) / stated if stated > 0.0 else None


def shown(row):
    """The row as a line."""
    parts = [f"{row['product']:<34}"]
    for name in ("reference", "spice", "ideal"):
        one = row.get(name)
        if one is None:
            continue
        if "failed" in one:
            parts.append(f"{name} FAILED {one['failed'][:150]}")
            continue
        error = one.get("doubt", one.get("stated"))
        part = f"{name} {one['mW']:.5g}+-{error:.2g}"
        if name != "reference":
            part += f" x{one.get('ratio') or -1:.2g} {one['wall']}s" + (
                " UNKNOWN " + one["unknown"] if one["unknown"] else ""
            )
            part += f" WARN {one['warnings']}" if one["warnings"] else ""
        parts.append(part)
    return " | ".join(parts)


def check(rows):
    """How many products that have a reference `spice` answers by more off it than both state, or not at all."""
    wrong = 0
    for row in rows:
        circuit, shaking, spring = row["product"].split()
        with tempfile.TemporaryDirectory() as folder:
            try:
                scene = scene_of(circuit, shaking, spring, Path(folder))
                answer = told(hv.Spice(**efforts(circuit, shaking)[0]).run(scene))
                off = judged(answer, row["reference"]) or 0.0
                print(f"{row['product']:<34} x{off:.2g} {answer['unknown']}", flush=True)
            except HarvesterError as error:
                off = math.inf
                print(f"{row['product']:<34} {error}", flush=True)
        wrong += off > 1.0
    return wrong


def main():
    words = [word for word in sys.argv[1:] if word != "--check"]
    rows = (
        {row["product"]: row for row in json.loads(RESULTS.read_text())["rows"]}
        if RESULTS.is_file()
        else {}
    )
    every = [
        one
        for one in itertools.product(CIRCUITS, SHAKINGS, SPRINGS)
        if one[0] not in CHIPS or one[1] == "harmonic"
    ]
    if unknown := set(words) - {*CIRCUITS, *SHAKINGS, *SPRINGS}:
        raise SystemExit(
            f"no product is called {', '.join(sorted(unknown))}: {', '.join((*CIRCUITS, *SHAKINGS, *SPRINGS))}"
        )
    if "--check" in sys.argv:
        kept = [
            row
            for name, row in rows.items()
            if "mW" in row["reference"] and set(words) <= set(name.split())
        ]
        raise SystemExit(int(check(kept) > 0))
    with contextlib.suppress(KeyboardInterrupt):
        for circuit, shaking, spring in every:
            name = f"{circuit} {shaking} {spring}"
            if not set(words) <= set(name.split()) or (not words and name in rows):
                continue
            rows[name] = measured(circuit, shaking, spring)
            print(shown(rows[name]), flush=True)
            with contextlib.redirect_stdout(None):
                report("products", [rows[one] for one in sorted(rows)])


if __name__ == "__main__":
    main()
