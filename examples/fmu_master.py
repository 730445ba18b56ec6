"""A master in Python: the device is an FMU with a stop, the master has the shaking and the load resistor.

The base moves with a sine.  The resistor takes the current V/R out of the electrodes: held over a
communication step (error of first order), or, with the state of the FMU restored and the step
repeated, the mean of both ends (second order).  The same resistor inside the FMU is the reference.
Run it:

    .venv/bin/python examples/fmu_master.py
"""

import math
import sys
import tempfile
from pathlib import Path

import harvester as hv

try:
    from fmpy import extract, read_model_description
    from fmpy.fmi2 import FMU2Slave
except ImportError:
    sys.exit("FMPy is missing: python -m pip install 'piezo-harvester[fmu]'")

SCENE = hv.Scene(
    oscillator=hv.Oscillator(mass="40 g", stiffness="16 N/m", damping="6.4e-3 N s/m"),
    piezo=hv.Piezo(coupling="1 mN/V", capacitance="50.2 nF"),
    stop=hv.Stop(restitution=0.9, gap="0.5 mm"),
)
RESISTANCE = 2e6  # ohm
AMPLITUDE = 0.2  # m/s^2
FREQUENCY = 4.5  # Hz
END = 1.6  # s
STEPS = (4e-3, 2e-3, 1e-3, 5e-4)  # s, communication steps
FINEST = 5e-5  # s, of the reference


def base(t):
    """The acceleration of the base (m/s^2)."""
    return AMPLITUDE * math.sin(2.0 * math.pi * FREQUENCY * t)


def exported(folder):
    """The device as an FMU with an electrical port."""
    return hv.export(SCENE, Path(folder) / "device.fmu", circuit="outside")


class Device:
    """An instance of the FMU, from rest."""

    def __init__(self, fmu, resistance=None):
        described = read_model_description(fmu)
        self.number = {one.name: one.valueReference for one in described.modelVariables}
        self.slave = FMU2Slave(
            guid=described.guid,
            unzipDirectory=extract(fmu, unzipdir=tempfile.mkdtemp(dir=Path(fmu).parent)),
            modelIdentifier=described.coSimulation.modelIdentifier,
            instanceName="device",
        )
        self.slave.instantiate()
        self.slave.setupExperiment(startTime=0.0)
        if resistance is not None:
            self.put("load_resistance", resistance)
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()

    def put(self, name, value):
        """Set an input or a parameter."""
        self.slave.setReal([self.number[name]], [value])

    def get(self, name):
        """The value of an output."""
        return self.slave.getReal([self.number[name]])[0]

    def step(self, t, h, current=0.0):
        """Advance by h with a current; the base's acceleration goes in a straight line."""
        self.put("current", current)
        self.put("base_acceleration", base(t))
        slope = (base(t + h) - base(t)) / h
        self.slave.setRealInputDerivatives([self.number["base_acceleration"]], [1], [slope])
        self.slave.doStep(currentCommunicationPoint=t, communicationStepSize=h)


def times(h):
    """The beginnings of the steps, and their lengths."""
    return [(k * h, (k + 1) * h - k * h) for k in range(round(END / h))]


def held(fmu, h):
    """The voltage at the end, with the current held over each step."""
    device = Device(fmu)
    for t, length in times(h):
        device.step(t, length, device.get("voltage") / RESISTANCE)
    return device.get("voltage")


def repeated(fmu, h):
    """The same with each step repeated, by the mean current of both ends."""
    device = Device(fmu)
    for t, length in times(h):
        before = device.get("voltage")
        state = device.slave.getFMUstate()
        device.step(t, length, before / RESISTANCE)
        for _ in range(2):
            mean = 0.5 * (before + device.get("voltage"))
            device.slave.setFMUstate(state)
            device.step(t, length, mean / RESISTANCE)
        device.slave.freeFMUstate(state)
    return device.get("voltage")


def inside(fmu, h=FINEST):
    """The same with the resistor across the electrodes inside the FMU: voltage and impacts."""
    device = Device(fmu, RESISTANCE)
    for t, length in times(h):
        device.step(t, length)
    impacts = device.slave.getInteger([device.number["impacts"]])[0]
    return device.get("voltage"), impacts


def errors(fmu):
    """The reference, and by communication step the errors of both masters."""
    reference, impacts = inside(fmu)
    rows = {h: (held(fmu, h) - reference, repeated(fmu, h) - reference) for h in STEPS}
    return reference, impacts, rows


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        voltage, impacts, rows = errors(exported(folder))
    print(f"voltage after {END} s and {impacts} impacts: {voltage:.6f} V")
    print("step (ms)   error, current held (V)   error, steps repeated (V)")
    for h, (first, second) in rows.items():
        print(f"{h * 1e3:8g}   {first:23.2e}   {second:25.2e}")
