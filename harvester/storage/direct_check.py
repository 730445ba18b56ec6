"""How far apart the time scales are: mass and circuit together from rest, beside the store that charges slowly."""

import math
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.equations.problem import Problem
from harvester.mechanics.kernels.step_size import step_from_rest, whole_steps
from harvester.storage.measured_current import time_constant

DIRECT = 25.0  # time constants of the mass, at most
EARLY, LATE = 0.5, 0.95  # of the voltage at the end of the direct run


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
