"""Engine `spice` under a harmonic base against ngspice alone: seconds and power, several circuits, in one run.

ngspice alone has the whole device as one netlist: the mass as a coil, the spring as a capacitor, the damping as a
resistor, the piezo as a transformer.  It runs from rest (`ngspice -b`) until the circuit has settled; the last two
periods are averaged.  Its options are those that engine `spice` gives it; a second run, at a hundredth of the
tolerance and a quarter of the step, says how far off the first is.  Ours is one call, its processes started.
"""

import time

from common import report
from whole_device import mean_power

PLATE = {"M": 0.04, "k": 16.0, "c": 0.16, "theta": 1.4e-4, "Cp": 50.2e-9, "g": 0.05, "f": 3.2}
BIMORPH = {"M": 16.542e-3, "k": 1364.1, "c": 0.25652, "theta": 2.5261e-3, "Cp": 41.259e-9, "g": 1.0, "f": 45.6}
CASES = {  # device, circuit, load and storage, periods until the circuit has settled
    "bimorph, bridge": (BIMORPH, "bridge", {"R": 1e5, "C": 1e-5}, 400),
    "bridge": (PLATE, "bridge", {"R": 1.5e6, "C": 3e-7}, 40),
    "parallel SSHI": (PLATE, "parallel_sshi", {"R": 5e6, "C": 1e-7}, 40),
    "series SSHI": (PLATE, "series_sshi", {"R": 6e5, "C": 8e-7}, 40),
    "SECE": (PLATE, "sece", {"R": 2e6, "C": 2e-7}, 40),
}
G = 9.80665


def alone(device, load, periods, reltol, steps):
    """Mean power (W) by ngspice alone, and its seconds."""
    given = device | {"force": device["M"] * G * device["g"]}
    begin = time.perf_counter()
    power = mean_power(given, load.name, load.parameters, load.text, periods - 2, reltol, steps)
    return power, time.perf_counter() - begin


def main():
    import harvester as hv
    from harvester.equations.problem import Problem

    rows = []
    for name, (device, netlist, parameters, periods) in CASES.items():
        scene = hv.Scene(
            oscillator=hv.Oscillator(mass=device["M"], stiffness=device["k"], damping=device["c"]),
            piezo=hv.Piezo(coupling=device["theta"], capacitance=device["Cp"]),
            excitation=hv.Excitation(acceleration_amplitude=G * device["g"], frequency=device["f"]),
            load=hv.Load(netlist=netlist, parameters=parameters),
        )
        load = Problem(scene).circuit
        hv.Spice(within=0.5).run(scene)  # what starts processes and compiles is not counted
        ours = hv.Spice().run(scene)
        power, seconds = alone(device, load, periods, 1e-4, 64)
        exact, longer = alone(device, load, periods, 1e-6, 1024)
        rows.append(
            {
                "case": name,
                "ours, uW": 1e6 * ours.mean_power.value,
                "stated": 1e6 * ours.mean_power.error95,
                "seconds": ours.seconds,
                "ngspice, uW": 1e6 * power,
                "its seconds": seconds,
                "tight, uW": 1e6 * exact,
                "tight seconds": longer,
                "ratio": ours.seconds / seconds,
                "ratio to tight": ours.seconds / longer,
            }
        )
        print(rows[-1], flush=True)
    report("steady", rows)


if __name__ == "__main__":
    main()
