"""100 uF behind a bridge on one measured bimorph, from empty to 3.3 V: by ngspice, and by ideal diodes under noise.

    python benchmarks/charge_on_device.py

The device and its shaking are those of circuits_on_device.py; the load is 10 Mohm, which takes next
to nothing.  Engine `ideal` charges under noise alone.
"""

import time

from circuits_on_device import DEVICE, HARMONIC, RANDOM
from common import report

import harvester as hv

STORE = hv.Load(netlist="bridge", parameters={"R": 10e6, "C": 100e-6})
# s
TARGET = "3.3 V"
DURATION = 8.0


def row(shaking, base, engine):
    """Mean time to the target with its errors (s), and the seconds that it took, compilation not counted."""
    scene = hv.Scene(**DEVICE, excitation=base, load=STORE)
    begin = time.perf_counter()
    found = hv.charge(scene, TARGET, engine=engine, duration=DURATION)
    return {
        "shaking": shaking,
        "engine": engine,
        "time": found.time.value,
        "stated": found.time.known_error95,
        "whole": found.time.error95 is not None,
        "reached": found.reached,
        "seconds": found.seconds,
        "clock": time.perf_counter() - begin,
    }


def main():
    cases = (
        ("harmonic", HARMONIC, "spice"),
        ("random", RANDOM, "ideal"),
        ("random", RANDOM, "spice"),
    )
    report("charge_on_device", [row(*case) for case in cases])


if __name__ == "__main__":
    main()
