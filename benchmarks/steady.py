"""Engine `spice` under a harmonic base against ngspice alone: seconds at the same measured error, ten scenes, one run.

ngspice alone has the whole device as one netlist: the mass as a coil, the spring as a capacitor, the damping as a
resistor, the piezo as a transformer.  It runs from rest (`ngspice -b`) until the circuit has settled; the last two
periods are averaged.  The reference is such a run with a tolerance of 1e-7 at two steps, extrapolated.  Beside it four
coarser runs, each by Gear's rule and by the trapezoidal one, say what an error costs ngspice alone: that of a run
counts as no less than those of the same rule's finer runs, for a smaller one is an accident, which nobody knows
beforehand (`ratio_with_luck` counts it).  Between them the seconds for the error that ours has are read off on
logarithmic axes, and beyond the best of them as its second order says.  Ours is one call with the default options, its
processes started; both are the best of two.

    python benchmarks/steady.py           # all: five minutes on a quiet machine
    python benchmarks/steady.py doubler   # those whose name holds a word; nothing is kept
"""

import itertools
import math
import sys
import time

from common import COIL, report
from whole_device import mean_power

PLATE = {"M": 0.04, "k": 16.0, "c": 0.16, "theta": 1.4e-4, "Cp": 50.2e-9, "g": 0.05, "f": 3.2}
BIMORPH = {
    "M": 16.542e-3,
    "k": 1364.1,
    "c": 0.25652,
    "theta": 2.5261e-3,
    "Cp": 41.259e-9,
    "g": 0.25,
    "f": 46.0,
}
STRONG = BIMORPH | {"g": 1.0, "f": 45.6}
CASES = {  # device, circuit, load and storage, periods until the circuit has settled
    "bimorph, bridge, large capacitor": (STRONG, "bridge", {"R": 1e5, "C": 1e-5}, 500),
    "bimorph, bridge": (BIMORPH, "bridge", {"R": 1.4e5, "C": 7e-7}, 120),
    "bimorph, doubler": (BIMORPH, "doubler", {"R": 5e5, "C": 2e-7}, 120),
    "bimorph, parallel SSHI": (BIMORPH, "parallel_sshi", {"R": 1.4e5, "C": 7e-7} | COIL, 120),
    "bimorph, SECE": (BIMORPH, "sece", {"R": 1e5, "C": 1e-6}, 120),
    "plate, bridge": (PLATE, "bridge", {"R": 1.5e6, "C": 3e-7}, 40),
    "plate, doubler": (PLATE, "doubler", {"R": 6e6, "C": 1e-7}, 40),
    "plate, parallel SSHI": (PLATE, "parallel_sshi", {"R": 5e6, "C": 1e-7} | COIL, 40),
    "plate, series SSHI": (PLATE, "series_sshi", {"R": 6e5, "C": 8e-7} | COIL, 40),
    "plate, SECE": (PLATE, "sece", {"R": 2e6, "C": 2e-7}, 40),
}
G = 9.80665
LINE = ((1e-3, 64), (1e-4, 256), (1e-5, 1024), (1e-6, 4096))  # reltol, steps in a period
METHODS = ("gear maxord=2", "trap")
LEAST = 1e-5  # relative error, below which nothing is compared


def scene_of(device, netlist, parameters):
    """The scene of a device and a circuit."""
    import harvester as hv

    return hv.Scene(
        oscillator=hv.Oscillator(mass=device["M"], stiffness=device["k"], damping=device["c"]),
        piezo=hv.Piezo(coupling=device["theta"], capacitance=device["Cp"]),
        excitation=hv.Excitation(acceleration_amplitude=G * device["g"], frequency=device["f"]),
        load=hv.Load(netlist=netlist, parameters=parameters),
    )


def alone(device, load, periods, reltol, steps, method):
    """Mean power (W) by ngspice alone, and its seconds; None where it fails."""
    given = device | {"force": device["M"] * G * device["g"]}
    begin = time.perf_counter()
    try:
        power = mean_power(given, load.text, periods - 2, reltol, steps, method)
    except SystemExit:
        return None
    return power, time.perf_counter() - begin


def seconds_for(error, line):
    """Seconds of ngspice alone for a relative error, from its (error, seconds): on and between the best of them."""
    best = [
        one for one in line if not any(other[0] <= one[0] and other[1] < one[1] for other in line)
    ]
    best.sort()
    if error <= best[0][0]:
        return best[0][1] * math.sqrt(best[0][0] / error)
    for (finer, longer), (rough, short) in itertools.pairwise(best):
        if error <= rough:
            part = math.log(error / finer) / math.log(rough / finer)
            return longer * (short / longer) ** part
    return best[-1][1]


def measured(name, device, netlist, parameters, periods):
    """The row of a case."""
    import harvester as hv
    from harvester.equations.problem import Problem

    scene = scene_of(device, netlist, parameters)
    load = Problem(scene).circuit
    hv.Spice(within=0.5).run(scene)  # what starts processes and compiles is not counted
    both = [hv.Spice().run(scene) for _ in range(2)]
    ours = both[0].mean_power
    seconds = min(one.seconds for one in both)
    coarse, fine = (
        alone(device, load, periods, 1e-7, steps, METHODS[0])[0] for steps in (2048, 4096)
    )
    exact = fine + (fine - coarse) / 3.0
    doubt = abs(exact - fine) / exact
    line, lucky = [], []
    for method in METHODS:
        least = max(doubt, 1e-9)
        for reltol, steps in reversed(LINE):
            runs = [alone(device, load, periods, reltol, steps, method) for _ in range(2)]
            if None not in runs:
                found = abs(runs[0][0] / exact - 1.0)
                took = min(runs[0][1], runs[1][1])
                lucky.append((max(found, doubt, 1e-9), took))
                least = max(found, least)
                line.append((least, took))
    error = abs(ours.value / exact - 1.0)
    theirs, with_luck = (seconds_for(max(error, doubt, LEAST), one) for one in (line, lucky))
    return {
        "case": name,
        "reference, uW": 1e6 * exact,
        "its doubt": doubt,
        "ours, uW": 1e6 * ours.value,
        "error": error,
        "stated": ours.known_error95 / ours.value,
        "seconds": seconds,
        "ngspice for it, s": theirs,
        "ratio": seconds / theirs,
        "ratio_with_luck": seconds / with_luck,
        "line": [[float(f"{one:.3g}") for one in pair] for pair in sorted(lucky)],
    }


def main():
    chosen = {
        name: case for name, case in CASES.items() if all(word in name for word in sys.argv[1:])
    }
    rows = []
    for name, case in chosen.items():
        rows.append(measured(name, *case))
        print(rows[-1], flush=True)
    if len(chosen) == len(CASES):
        report("steady", rows)


if __name__ == "__main__":
    main()
