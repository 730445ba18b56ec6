"""What is behind a rectifier, over hours: the rest of the netlist as a compiled circuit, fed by the mean current.

    i' = (I(u) - i)/tau(u)        u: the voltage between the rectifier's rails

The current follows I(u) with the lag that was measured, from 0 at rest.  Steps are those of the slow circuit, many
vibrations of the fast one may pass in each; within a step the circuit chooses its own.

How far apart the time scales are `direct_check` tells: mass and circuit together from rest, beside the slow store.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.circuits.fed_circuit import feed
from harvester.circuits.substeps import ROOMS
from harvester.equations.problem import Problem
from harvester.equations.scales import Scales
from harvester.mechanics.kernels.step_size import step_from_rest, whole_steps
from harvester.netlists.load_circuit import LoadCircuit
from harvester.storage.measured_current import time_constant
from harvester.storage.rectified_current import RectifiedCurrent
from harvester.storage.rectifier_cut import Cut

DIRECT = 25.0  # time constants of the mass, at most
EARLY, LATE = 0.5, 0.95  # of the voltage at the end of the direct run
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


class DirectCheck(NamedTuple):
    """What mass and circuit together take longer (s) than the slow store, by the end and half-way, in ``seconds``."""

    late: float
    early: float
    seconds: float
    steps: int

    @property
    def error(self) -> float:
        """How much the difference still changed (s)."""
        return abs(self.late - self.early)


def direct_check(
    problem: Problem, circuit: CompiledCircuit, volts: Floats, times: Floats, longest: float, h: float | None = None
) -> DirectCheck:
    """The check under a drive, of a whole circuit whose store the slow computation takes to ``volts`` at ``times``.

    Both are ascending and finite; the direct run is as ``longest`` at most.
    """
    eqs, w0 = problem.equations, problem.scales.frequency
    seconds = min(float(times[-1]), DIRECT * time_constant(eqs) / w0, longest)
    step = whole_steps(step_from_rest(eqs) if h is None else h, eqs.shaking_period)
    kicks = math.ceil(seconds * w0 / step / 16) * 16
    path = circuit.trace(eqs, np.zeros(kicks), step, 16)
    t = np.append(0.0, step * 16.0 * np.arange(1, len(path.told) + 1) / w0)
    store = np.append(0.0, np.maximum.accumulate(path.told[:, 1]))
    places = np.array([EARLY, LATE]) * min(float(np.interp(seconds, times, volts)), float(store[-1]))
    early, late = np.interp(places, store, t) - np.interp(places, volts, times)
    return DirectCheck(float(late), float(early), seconds, path.steps)
