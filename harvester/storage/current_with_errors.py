"""The rectifier's current of a scene: under a drive with the error of its step, under noise with that of sampling."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.circuits.parts import CircuitPart
from harvester.equations.problem import Problem
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit
from harvester.mechanics.kernels.step_size import step_from_rest
from harvester.storage.measured_current import HeldPath, HeldRuns, measured_current, open_voltage
from harvester.storage.rectified_current import RectifiedCurrent

VOLTAGES = 12
RUNS = 512  # under noise, at each voltage


class Currents(NamedTuple):
    """I(V), the same of the scene's step where its own error is known, and how many steps they took.

    ``displacement`` is the largest (m) on the way up under a drive; None under noise.
    """

    best: RectifiedCurrent
    rough: RectifiedCurrent
    steps: int
    displacement: float | None = None


def measured(
    problem: Problem,
    elements: Sequence[CircuitPart],
    ideal: IdealCircuit | None = None,
    top: float | None = None,
    h: float | None = None,
    seed: int = 0,
    count: int = VOLTAGES,
) -> Currents:
    """I(V) of ``elements`` whose store is held, at ``count`` voltages from 0 to ``top``, or to the open circuit's.

    Under a drive it is extrapolated from two steps of the compiled circuit.  Under noise it is that of the ``ideal``
    circuit where there is one, and of the scene's step alone.
    """
    assert problem.circuit is not None, "what has a rectifier is a circuit"
    eqs, h = problem.equations, step_from_rest(problem.equations) if h is None else h
    volts = np.linspace(0.0, open_voltage(problem, h, seed) if top is None else top, count)
    if not eqs.is_steady:
        fast = ideal or CompiledCircuit(problem.circuit, problem.scales, elements)
        held = HeldRuns(problem, fast, RUNS, seed, h)
        table = measured_current(held, eqs, volts, held.runs.together)
        return Currents(table, table, held.runs.steps)
    paths = [HeldPath(problem, problem.circuit, elements, factor * h) for factor in (1.0, 2.0)]
    fine, coarse = (measured_current(one, eqs, volts) for one in paths)
    steps, peak = sum(one.steps for one in paths), max(one.peak for one in paths) * problem.scales.length
    return Currents(fine.extrapolated(coarse), fine, steps, peak)
