"""Circuit-level co-simulation of vibro-impact piezoelectric energy harvesters."""

from harvester.engines import Averaged, Cheapest, Ensemble, Ideal, Published, Spice
from harvester.estimate import Estimate, Value
from harvester.scene import (
    Excitation,
    Load,
    Nondimensional,
    OppositeStop,
    Oscillator,
    Piezo,
    Scene,
    Stop,
    load,
    loads,
)

__all__ = [
    "Averaged",
    "Cheapest",
    "Ensemble",
    "Estimate",
    "Excitation",
    "Ideal",
    "Load",
    "Nondimensional",
    "OppositeStop",
    "Oscillator",
    "Piezo",
    "Published",
    "Scene",
    "Spice",
    "Stop",
    "Value",
    "load",
    "loads",
]
__version__ = "0.1.0"
