"""What is behind a rectifier, over hours: the rest of the netlist as a compiled circuit, fed by the mean current.

    i' = (I(u) - i)/tau(u)        u: the voltage between the rectifier's rails

The current follows I(u) with the lag that was measured, from 0 at rest.  Steps are those of the slow circuit, many
vibrations of the fast one may pass in each; within a step the circuit chooses its own.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.circuits.fed_circuit import feed
from harvester.circuits.substeps import ROOMS
from harvester.equations.scales import Scales
from harvester.netlists.load_circuit import LoadCircuit
from harvester.storage.rectified_current import RectifiedCurrent
from harvester.storage.rectifier_cut import Cut

POINTS = 2048  # of the table that the kernel reads
TOLERANCE = 3e-3  # of a charge's size: what the two orders of a step may differ by
SMALL = 50.0  # what is left between the rails of the piezo's capacitance: this part


@dataclass(frozen=True)
class SlowPath:
    """The slow circuit over time, shape (n,): s, V of the rails, the store and the load, and integrals up to then.

    ``square`` is that of the load's squared voltage (V^2 s), ``piezo`` that of the piezo's mean square voltage.
    """

    t: Floats
    rails: Floats
    store: Floats
    load: Floats
    square: Floats
    piezo: Floats
    steps: int
    failed: int


class SlowCircuit:
    """The circuit behind a cut, at steps of ``seconds``; ``scales`` are those of the device.

    Raises as `CompiledCircuit`.
    """

    def __init__(self, load: LoadCircuit, cut: Cut, scales: Scales, tolerance: float = TOLERANCE) -> None:
        self.scales = replace(scales, coupling=scales.coupling / SMALL, capacitance=scales.capacitance / SMALL)
        self.circuit = CompiledCircuit(load, self.scales, cut.slow(), tolerance)

    def run(self, current: RectifiedCurrent, duration: float, seconds: float, stride: int = 1) -> SlowPath:
        """From empty and at rest for a ``duration`` in s, every ``stride`` of its steps of ``seconds``."""
        rows = math.ceil(duration / (seconds * stride) - 1e-9)
        top = float(current.voltages[-1])
        volts = np.linspace(0.0, top, POINTS)
        table = np.array([current.at(volts), current.sampled("lag", volts), current.sampled("square", volts)])
        out = np.empty((rows, 5))
        own, state = self.circuit.for_kernels(seconds * self.scales.frequency), self.circuit.rest
        room = np.empty((ROOMS, own.length))
        charge = self.scales.capacitance * self.scales.volts
        steps, failed = feed(own, state, room, table, top, seconds, current.delay, charge, stride, out)
        t = seconds * stride * np.arange(1.0, rows + 1.0)
        return SlowPath(t, out[:, 0], out[:, 1], out[:, 2], out[:, 3], out[:, 4], int(steps), int(failed))
