"""Microseconds an accepted ngspice step: ngspice alone with a built-in source, and in lock-step with the mass.

Each runs in a process of its own, in turn, in one go; same circuit, same number of steps.
"""

import time
from multiprocessing import get_context

import numpy as np
from common import report

STEPS, STEP = 200_000, 0.1 / 20
CIRCUIT = """.title alone
Vdrive drive 0 SIN(0 1 3.18)
Cp drive p 50.2n ic=0
Rload p 0 1e6
.options method=trap trtol=1e6 chgtol=1
.save v(p) @rload[p]
.tran {step} {stop} 0 {step} uic
.end
"""


def alone(_):
    """ngspice through PySpice without any callback of ours."""
    from PySpice.Spice.NgSpice.Shared import NgSpiceShared

    from harvester.circuit.library import find_library

    NgSpiceShared.LIBRARY_PATH = find_library()
    ngspice = NgSpiceShared()
    ngspice.load_circuit(CIRCUIT.format(step=STEP, stop=STEPS * STEP))
    begin = time.perf_counter()
    ngspice._ngspice_shared.ngSpice_Command(b"run")
    seconds = time.perf_counter() - begin
    steps = ngspice._ngspice_shared.ngGet_Vec_Info(b"time").v_length
    return seconds / steps * 1e6, steps


def lockstep(restitution):
    """The strongly coupled plate; with a restitution coefficient, also with its stop."""
    from harvester.circuit.lockstep import Drive
    from harvester.circuit.netlist import load_circuit
    from harvester.circuit.ngspice import netlist, ngspice
    from harvester.scaling import Equations
    from harvester.scene import Load

    eqs = Equations(beta=1.25, mu=1.0, c1=-0.008, n1=1.0, restitution=restitution)
    noise = np.random.default_rng(1).standard_normal(STEPS)
    for n in (100, STEPS):  # the first compiles
        drive = Drive(eqs, 1.0, 20.0, noise[:n], 0.1, stride=4)
        text = netlist(load_circuit(Load(resistance=1e6)), 50.2e-9, STEP, drive.duration)
        begin = time.perf_counter()
        ngspice().run_driven(text, drive)
        seconds = time.perf_counter() - begin
    steps = int(drive.record["steps"][0])
    return seconds / steps * 1e6, steps


def measure(job):
    """A job in a fresh process."""
    function, argument = job
    with get_context("spawn").Pool(1) as pool:
        return pool.apply(function, (argument,))


if __name__ == "__main__":
    jobs = {"ngspice alone": (alone, None), "lock-step": (lockstep, None), "lock-step with impacts": (lockstep, 0.96)}
    times = {name: [] for name in jobs}
    for _ in range(5):
        for name, job in jobs.items():
            times[name].append(measure(job))
    base = np.median([t for t, _ in times["ngspice alone"]])
    rows = [
        {
            "what": name,
            "us/step, median": float(np.median([t for t, _ in all_of])),
            "least": float(min(t for t, _ in all_of)),
            "over ngspice alone": float(np.median([t for t, _ in all_of]) / base),
            "accepted steps a grid step": all_of[0][1] / STEPS,
        }
        for name, all_of in times.items()
    ]
    report("lockstep", rows)
