"""FMUs built once for all tests, and run by FMPy in a process in which this package cannot be imported."""

import functools
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from harvester.devices.fmu.unit import export_fmu
from tests.support.located_impacts import Device, Flow
from tests.support.paths import EXAMPLES

HERE = "linux-x86_64"
BEGIN = """
import json, sys
class Refused:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("harvester", "numba", "llvmlite"):
            raise ImportError(f"{name} must not be needed")
sys.meta_path.insert(0, Refused())
import warnings
warnings.simplefilter("ignore")
import numpy as np
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.validation import validate_fmu
fmu = sys.argv[1]
described = read_model_description(fmu)
number = {v.name: v.valueReference for v in described.modelVariables}
h = float(described.defaultExperiment.stepSize)
def opened(version=2, **options):
    from fmpy.fmi2 import FMU2Slave
    from fmpy.fmi3 import FMU3Slave
    kind = FMU3Slave if version == 3 else FMU2Slave
    folder = extract(fmu)
    return kind(guid=described.guid, unzipDirectory=folder, modelIdentifier=described.coSimulation.modelIdentifier,
                instanceName="one", **options)
def begun(slave, version=2, start=0.0, **values):
    if version == 2:
        slave.instantiate()
        slave.setupExperiment(startTime=start)
    for name, value in values.items():
        (slave.setReal if version == 2 else slave.setFloat64)([number[name.replace("__", ".")]], [value])
    slave.enterInitializationMode() if version == 2 else slave.enterInitializationMode(startTime=start)
    slave.exitInitializationMode()
    return slave
def shown(slave, *names, version=2):
    return (slave.getReal if version == 2 else slave.getFloat64)([number[name] for name in names])
def path(slave, names, t, steps):
    out = []
    for _ in range(steps):
        slave.doStep(t, 0.0123)
        t += 0.0123
        out.append(shown(slave, *names))
    return out
"""
# With event mode and without: how many events, the ``names`` at the end, and the impacts
EVENTS = """
found = []
for events in (True, False):
    slave = opened(3)
    slave.instantiate(eventModeUsed=events, earlyReturnAllowed=events)
    begun(slave, 3)
    if events:
        slave.enterStepMode()
    t, count = 0.0, 0
    while t < 5.0 - 1e-9:
        event, _, early, t = slave.doStep(t, min(0.01, 5.0 - t), noSetFMUStatePriorToCurrentPoint=True)
        if event:
            count += 1
            slave.enterEventMode()
            slave.updateDiscreteStates()
            slave.enterStepMode()
    found.append([count, *shown(slave, *names, version=3), slave.getInt32([number["impacts"]])[0]])
print(json.dumps(found))
"""
# Mean power of trajectories with different seeds, after a burn-in
POWERS = """
powers = []
for seed in range({seeds}):
    one = opened()
    one.instantiate()
    one.setupExperiment(startTime=0.0)
    one.setInteger([number["seed"]], [seed])
    one.enterInitializationMode()
    one.exitInitializationMode()
    one.doStep(0.0, 30.0)
    (before,) = shown(one, "{energy}")
    one.doStep(30.0, 120.0)
    powers.append((shown(one, "{energy}")[0] - before) / 120.0)
    one.terminate()
    one.freeInstance()
print(json.dumps(powers))
"""
# Each of some accelerations for a second: done with finite outputs, or the error
HARSH = """
answers = []
for a in accelerations:
    one = begun(opened())
    one.setReal([number["base_acceleration"]], [a])
    for k in range(20):
        try:
            one.doStep(0.05 * k, 0.05)
            answers.append("done" if np.isfinite(shown(one, "voltage", "displacement")).all() else "not finite")
        except Exception as error:
            answers.append(str(error))
            break
print(json.dumps(answers))
"""


@functools.cache
def _folder():
    """A folder of this process, removed when it ends."""
    return tempfile.TemporaryDirectory(prefix="fmu-of-tests-")


@functools.cache
def built(scene="plate_harmonic_stop.toml", fmi=2, circuit="inside"):
    """The FMU of an example, or of a scene file, for this system; made once in a process."""
    folder = Path(tempfile.mkdtemp(dir=_folder().name))
    path = folder / f"{Path(scene).stem}_{fmi}_{circuit}.fmu"
    export_fmu(EXAMPLES / scene, path, circuit=circuit, fmi=fmi, platforms=[HERE])
    return path


def run(path, code, timeout=120):
    """What a program prints as JSON that imports FMPy, and runs an FMU without this package."""
    done = subprocess.run(
        [sys.executable, "-c", BEGIN + code, str(path)],
        capture_output=True, text=True, timeout=timeout, check=False, cwd=path.parent,
        env={**os.environ, "TMPDIR": _folder().name},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout.splitlines()[-1])


def powers(scene, seeds, energy):
    """The mean power (W) of trajectories of a scene, by an output of energy, one for each seed."""
    return run(built(scene), POWERS.format(seeds=seeds, energy=energy), timeout=300)


def plate(amplitude=0.02 * 9.80665, frequency=4.5, resistance=1e7):
    """The device of plate_harmonic_stop.toml in the exact flow, whose drive pushes the mass by + A cos."""
    one = np.ones(1)
    return Device(
        0.04 * np.eye(1), 6.4e-3 * np.eye(1), 16.0 * np.eye(1), 1e-3 * one, -0.04 * one, one,
        capacitance=50.2e-9, resistance=resistance, amplitude=amplitude,
        frequency=2.0 * np.pi * frequency,
    )  # fmt: skip


def exact_impacts(device, seconds, gap=5e-4, restitution=0.9):
    """Times of impacts and speeds before them, from rest, by exact flow and roots to rounding."""
    flow = Flow(device.free)
    z = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 1.0])
    time = 0.0
    found = []
    grid = np.arange(1, 401) * device.grid
    while time < seconds:
        times = np.concatenate([[1e-12], grid])
        below = flow.at(z, times)[:, 0] + gap < 0.0
        if not below[1:].any():
            z = flow.at(z, grid[-1:])[0]
            time += grid[-1]
            continue
        k = 1 + int(np.argmax(below[1:]))
        hit = brentq(
            lambda t, z=z: flow.at(z, np.array([t]))[0, 0] + gap, times[k - 1], times[k], xtol=1e-15
        )
        z = flow.at(z, np.array([hit]))[0]
        time += hit
        found.append((time, -z[1]))
        z[0] = -gap
        z[1] *= -restitution
    return np.array([one for one in found if one[0] <= seconds])
