"""Nine circuits on one measured bimorph: power and efficiency under a harmonic base, and under a random one.

The device is that of Erturk and Inman (Smart Mater. Struct. 18, 025009, 2009) as one mode.  Each
circuit has the best of a few loads under the harmonic base, and the same load under noise.  The
efficiency is what the load gets of the power that the piezo gives.

    python benchmarks/circuits_on_device.py             # all, many minutes
    python benchmarks/circuits_on_device.py sshc sece   # some, the others stay as they are in results/

Under noise ngspice takes some hundred steps for each switching of a circuit that switches at the extrema: 16 runs
of the default length need minutes.  Here each has fewer and shorter ones (`NOISY`).  Those of a circuit that engine
`ideal` has begin settled and are paired with it: half a second of eight runs says 2 %.
"""

import json
import sys
from pathlib import Path

from common import COIL, report

import harvester as hv
from harvester.errors import HarvesterError

DEVICE = {
    "oscillator": hv.Oscillator(mass=16.542e-3, stiffness=1364.1, damping_ratio=0.027),
    "piezo": hv.Piezo(coupling=2.5261e-3, capacitance=41.259e-9),
}
HARMONIC = hv.Excitation(acceleration_amplitude="0.25 g", frequency=46.0)
RANDOM = hv.Excitation(acceleration_psd="2e-3 g^2/Hz")
LOADS = {
    "resistor": (35e3, 70e3),
    "bridge": (70e3, 140e3),
    "doubler": (250e3, 500e3),
    "parallel_sshi": (70e3, 140e3),
    "series_sshi": (100e3, 200e3),
    "sece": (100e3,),
    "self_powered_sshi": (70e3, 140e3),
    "sshc": (70e3, 140e3),
    "ltc3588": (24e3, 22e3),  # little enough that the output stays on at 46 Hz
}
PAIRED, ALONE = {"trajectories": 8, "duration": 0.5}, {"trajectories": 10, "duration": 1.0}
NOISY = dict.fromkeys(("parallel_sshi", "series_sshi", "sece"), PAIRED) | dict.fromkeys(
    ("self_powered_sshi", "sshc", "ltc3588"), ALONE
)
CHIP = {"C": 2.2e-6, "Cout": 1e-6}
SMOOTHED = 0.1  # s: load times smoothing capacitance
BUDGET = "5min"


def load_of(name, resistance):
    """The load: its smoothing capacitor holds the voltage over some periods."""
    if name == "resistor":
        return hv.Load(resistance=resistance)
    if name == "ltc3588":
        return hv.Load(netlist=name, parameters={"R": resistance} | CHIP)
    coil = COIL if name in ("parallel_sshi", "series_sshi") else {}
    return hv.Load(netlist=name, parameters={"R": resistance, "C": SMOOTHED / resistance} | coil)


def answer(name, resistance, shaking):
    """Power (mW), its stated error, and the efficiency of one circuit."""
    base = HARMONIC if shaking == "harmonic" else RANDOM
    effort = NOISY.get(name, {}) if shaking == "random" else {}
    found = hv.Spice(budget=BUDGET, **effort).run(
        hv.Scene(**DEVICE, excitation=base, load=load_of(name, resistance))
    )
    power, details = found.mean_power, found.details
    taken = details["ledger_load"] + details["ledger_circuit"] if name != "resistor" else 0.0
    return {
        "load": resistance,
        "mW": 1e3 * power.value,
        "stated": 1e3 * power.known_error95,
        "whole": power.error95 is not None,
        "efficiency": details["ledger_load"] / taken if taken else 1.0,
        "seconds": found.seconds,
    }


def main():
    asked = sys.argv[1:]
    kept = Path(__file__).parent / "results" / "circuits_on_device.json"
    found = (
        {row["circuit"]: row for row in json.loads(kept.read_text())["rows"]}
        if kept.is_file()
        else {}
    )
    for name in asked or LOADS:
        best = None
        for resistance in LOADS[name]:
            try:
                one = answer(name, resistance, "harmonic")
            except HarvesterError as error:
                print(name, resistance, str(error)[:120], flush=True)
                continue
            best = one if best is None or one["mW"] > best["mW"] else best
        if best is None:
            continue
        try:
            noisy = answer(name, best["load"], "random")
        except HarvesterError as error:
            print(name, str(error)[:120], flush=True)
            noisy = {}
        random = {f"random {key}": value for key, value in noisy.items() if key != "load"}
        found[name] = {"circuit": name, **best, **random}
        # what is done survives ^C
        report("circuits_on_device", [found[one] for one in LOADS if one in found])


if __name__ == "__main__":
    main()
