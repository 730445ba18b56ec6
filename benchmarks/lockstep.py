"""Cost of an accepted ngspice step, and error of V on a shared path, against the exact RC update.

Cost: ngspice alone with a built-in source, in lock-step with the mass by compiled callbacks, and by
Python ones; the same circuit, options and saved vectors, each in a process of its own, in turn, in
one go.

Error: relative RMS of V over 100 time units on noise paths refined by bridge.
"""

import dataclasses
import math
import sys
import time
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from common import COIL, PAPER, report

CP = 50.2e-9
H = 0.1
W0 = 20.0
STEP = H / W0
LOADS = {  # name: parameters, kicks of the compiled and of the Python path
    "resistor": ({"R": 1e6}, 200_000, 5_000),
    "bridge": ({"R": 1e6, "C": 1e-6}, 60_000, 3_000),
    "parallel_sshi": ({"R": 5e6, "C": 1e-6} | COIL, 8_000, 500),
}
ROUNDS = 5


def circuit(name):
    from harvester.netlists.load_circuit import load_circuit
    from harvester.scene.load import Load

    parameters = LOADS[name][0]
    load = (
        Load(resistance=parameters["R"])
        if name == "resistor"
        else Load(netlist=name, parameters=parameters)
    )
    return load_circuit(load, CP)


def alone(name):
    """ngspice through PySpice with a sine of 20 V and not a callback of ours."""
    from PySpice.Spice.NgSpice.Shared import NgSpiceShared

    from harvester.cosimulation.ngspice.deck import build_deck
    from harvester.cosimulation.ngspice.locate_libngspice import find_library

    text = build_deck(circuit(name), CP, STEP, LOADS[name][1] * STEP).text
    NgSpiceShared.LIBRARY_PATH = find_library()
    ngspice = NgSpiceShared()
    ngspice.load_circuit(text.replace("external", f"SIN(0 20 {W0 / (2 * math.pi)!r})"))
    begin = time.perf_counter()
    ngspice._ngspice_shared.ngSpice_Command(b"run")
    seconds = time.perf_counter() - begin
    steps = ngspice._ngspice_shared.ngGet_Vec_Info(b"time").v_length
    return seconds / steps * 1e6


def lockstep(name, compiled, restitution=None):
    """A device of some 20 V, with a restitution coefficient also with its stop."""
    from harvester.cosimulation.lockstep.drive import Drive
    from harvester.cosimulation.ngspice.deck import build_deck
    from harvester.cosimulation.ngspice.instance import ngspice
    from harvester.equations.coefficients import Equations

    eqs = Equations(beta=0.05, c1=-0.05, n1=0.05, restitution=restitution)
    load = circuit(name)
    noise = np.random.default_rng(1).standard_normal(LOADS[name][1 if compiled else 2])
    for n in (100, len(noise)):  # the first compiles
        drive = Drive(eqs, 20.0, W0, noise[:n], H, stride=4, free=not load.linear, since=0.0)
        if not compiled:
            sys.path.insert(0, str(Path(__file__).parents[1]))
            from tests.support.python_callbacks import PythonCallbacks

            callbacks = PythonCallbacks(drive, ngspice().state)  # noqa: F841, alive until the run ends
        whole = build_deck(load, CP, STEP, drive.duration)
        begin = time.perf_counter()
        ngspice().run_driven(whole, drive)
        seconds = time.perf_counter() - begin
    return seconds / int(drive.state["accepted"][0]) * 1e6


def measure(function, *arguments):
    """A job in a fresh process."""
    with get_context("spawn").Pool(1) as pool:
        return pool.apply(function, arguments)


def costs():
    jobs = {}
    for name in LOADS:
        jobs[name, "ngspice alone"] = (alone, name)
        jobs[name, "compiled"] = (lockstep, name, True)
        jobs[name, "Python"] = (lockstep, name, False)
    jobs["resistor", "compiled, with impacts"] = (lockstep, "resistor", True, 0.96)
    times = {job: [] for job in jobs}
    for _ in range(ROUNDS):
        for key, job in jobs.items():
            times[key].append(measure(*job))
    base = {name: np.median(times[name, "ngspice alone"]) for name in LOADS}
    return [
        {
            "load": name,
            "callbacks": how,
            "us/step, median": float(np.median(found)),
            "least": float(min(found)),
            "over ngspice alone": float(np.median(found) / base[name]),
        }
        for (name, how), found in times.items()
    ]


def errors():
    from harvester.cosimulation import runs as worker
    from harvester.equations.coefficients import Equations
    from harvester.equations.scales import Scales
    from harvester.mechanics.kernels.noise import gaussian_grid, refined
    from harvester.mechanics.trace import trace
    from harvester.netlists.load_circuit import load_circuit
    from harvester.scene.load import Load

    plate = Equations(beta=1.25, mu=1.0, c1=-0.05, n1=0.01)
    scenes = {
        "paper, r = .96": PAPER,
        "plate, beta = 1.25": plate,
        "plate with stop": dataclasses.replace(plate, restitution=0.96),
    }
    rows = []
    for scene, eqs in scenes.items():
        s = Scales(
            mass=0.04,
            frequency=W0,
            length=1e-3,
            coupling=math.sqrt(eqs.beta * 16 * CP),
            capacitance=CP,
        )
        load = load_circuit(Load(resistance=s.resistance(eqs.mu)))
        noise = gaussian_grid(np.random.SeedSequence(7), 500)
        rng = np.random.default_rng(1)
        for h in (0.2, 0.1, 0.05, 0.025):
            exact = trace(eqs, noise, h)
            path = worker.path_in_worker(worker.CoupledDevice(eqs, s, load, h, 1), noise)
            error = float(np.sqrt(np.mean((path.V - exact.V) ** 2) / np.mean(exact.V**2)))
            rows.append({"scene": scene, "step": h, "error": error})
            noise = refined(noise, rng)
    return rows


if __name__ == "__main__":
    report("lockstep", costs() + errors())
