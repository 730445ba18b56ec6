"""Devices whose paths ngspice and the exact update both compute."""

import math

import numpy as np

from harvester.cosimulation import runs as worker
from harvester.cosimulation.worker_pool import map_in_workers
from harvester.equations.scales import Scales
from harvester.mechanics.kernels.noise import gaussian_grid
from harvester.mechanics.trace import trace
from harvester.netlists.load_circuit import load_circuit
from harvester.scene.load import Load
from tests.support.python_callbacks import path_in_python
from tests.support.systems import changed, linear, padded

CP = 50.2e-9
PLATE = linear(1.25, 1.0)
SEED = np.random.SeedSequence(7)
# a weakly coupled device
WEAK = Scales(mass=0.04, frequency=20.0, length=0.05, coupling=2e-4, capacitance=CP)


def device(eqs, h, stride=1, scales=None):
    s = scales or Scales(mass=0.04, frequency=20.0, length=1e-3, coupling=1e-3, capacitance=CP)
    return worker.CoupledDevice(
        eqs, s, load_circuit(Load(resistance=s.resistance(eqs.mu))), h, stride
    )


def both(eqs, h, duration=100.0, stride=4, scales=None, noise=None):
    """The same path by ngspice and by the exact update, with absent terms at strength zero: see `padded`."""
    eqs = changed(padded(eqs), beta=eqs.beta)
    noise = gaussian_grid(SEED, round(duration / h)) if noise is None else noise
    return worker.path_in_worker(device(eqs, h, stride, scales), noise), trace(
        eqs, noise, h, stride
    )


def check_callbacks(device, noise, shaking=None):
    """The compiled callbacks and the interpreted ones give the same path, to the last digit."""
    fast = worker.path_in_this_process(device, noise, shaking)
    plain = path_in_python(device, noise, shaking)
    assert (fast.samples == plain.samples).all()
    assert (fast.impacts == plain.impacts).all()


def rms_difference(a, b, name="V"):
    a, b = getattr(a, name), getattr(b, name)
    return np.sqrt(np.mean((a - b) ** 2) / np.mean(b**2))


def scales(beta, length=0.05):
    """A device of 40 g and 16 N/m whose coupling gives beta = theta^2/(k Cp)."""
    return Scales(
        mass=0.04,
        frequency=20.0,
        length=length,
        coupling=math.sqrt(beta * 16.0 * CP),
        capacitance=CP,
    )


def charging_curve(device, noise):
    """Times (s) and voltages (V) of the load's Csmooth while it is charged, and its capacitance (F), in a worker."""
    return next(map_in_workers(_charging_curve, [(device, noise)]))


def _charging_curve(device, noise):
    drive = worker.run_in_this_process(device, worker.new_drive(device, noise))
    return drive.path().t / device.scales.frequency, drive.charge, drive.smoothing
