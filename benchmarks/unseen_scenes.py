"""Linear scenes of benchmarks/unseen.py, and their voltages."""

import math

import numpy as np

import harvester as hv
from harvester.arrays import Floats

TURN = 2.0 * math.pi


def amplitudes(scenes: list[hv.Scene]) -> Floats:
    """The voltage amplitude of each linear scene under its sine (V)."""
    return np.sqrt([2.0 * hv.run(scene, "exact").mean_square_voltage.value for scene in scenes])


def linear(
    mass: float, frequency: float, ratio: float, coupling: float, capacitance: float
) -> hv.Scene:
    """A scene of one mode, of a resonance in short circuit (Hz); load and excitation are put in later."""
    return hv.Scene(
        oscillator=hv.Oscillator(
            mass=mass, stiffness=mass * (TURN * frequency) ** 2, damping_ratio=ratio
        ),
        piezo=hv.Piezo(coupling=coupling, capacitance=capacitance),
        excitation=hv.Excitation(acceleration_amplitude=1.0, frequency=frequency),
        load=hv.Load(resistance=1e6),
    )


def shaken(scene: hv.Scene, acceleration: float, frequency: float, resistance: float) -> hv.Scene:
    """The scene under another sine, on another resistor."""
    here = scene.varied(
        {"excitation.acceleration_amplitude": acceleration, "excitation.frequency": frequency}
    )
    return here.with_load(resistance=resistance)
