"""Engine `spice` under a harmonic base against ngspice alone: seconds and power, several circuits, in one run.

ngspice alone has the whole device as one netlist: the mass as a coil, the spring as a capacitor, the damping as a
resistor, the piezo as a transformer.  It runs from rest (`ngspice -b`) until the circuit has settled; the last two
periods are averaged.  Its options are those that engine `spice` gives it; a second run, at a hundredth of the
tolerance and a quarter of the step, says how far off the first is.  Ours is one call, its processes started.
"""

import re
import subprocess
import time

from common import report

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
MESH = """whole device
Vbase b0 0 SIN(0 {force!r} {f!r} 0 0 90)
Lmass b0 b1 {M!r}
Rdamping b1 b2 {c!r}
Cspring b2 b3 {compliance!r}
Etransformer b3 b4 p 0 {theta!r}
Vspeed b4 0 0
Ftransformer 0 p Vspeed {theta!r}
Cp p 0 {Cp!r}
Xload p 0 {name} {parameters}
{text}
.options method=gear maxord=2 reltol={reltol!r}
.save @r.xload.rload[p]
.tran {step!r} {end!r} {begin!r} {step!r} uic
.control
run
meas tran power AVG @r.xload.rload[p]
.endc
.end
"""


def alone(device, load, periods, reltol, steps):
    """Mean power (W) by ngspice alone, and its seconds."""
    period = 1.0 / device["f"]
    parameters = " ".join(f"{name}={value!r}" for name, value in load.parameters.items())
    given = device | {"force": device["M"] * G * device["g"], "compliance": 1.0 / device["k"], "name": load.name}
    times = {"step": period / steps, "end": periods * period, "begin": (periods - 2) * period}
    deck = MESH.format(**given, parameters=parameters, text=load.text, reltol=reltol, **times)
    begin = time.perf_counter()
    done = subprocess.run(["ngspice", "-b", "/dev/stdin"], input=deck, capture_output=True, text=True, check=False)
    seconds = time.perf_counter() - begin
    return float(re.search(r"power\s+=\s+(\S+)", done.stdout)[1]), seconds


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
