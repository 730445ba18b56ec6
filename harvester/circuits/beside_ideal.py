"""Trajectories of a compiled circuit that begin in states of the same circuit made of ideal elements."""

import time

import numpy as np

from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.machine.progress import listener, stage
from harvester.mechanics.ensemble.affordable_steps import check_cost
from harvester.mechanics.ensemble.burn_in import memory
from harvester.mechanics.ensemble.compiled_pair import compile_pair
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.compiled import compilation

RAMP = 16  # parts in which a storage capacitor is charged
# time constants, in which a compiled circuit settles from the states of ideal elements
SETTLING = 4.0
PARTS = 8  # of settling; before each, what is left of it must fit into the budget


def compiled_beside(
    settled: Trajectories, circuit: CompiledCircuit, count: int, seed: np.random.SeedSequence
) -> tuple[Trajectories, float]:
    """Trajectories of the compiled circuit in states of an ideal one's, ``settled``, with the storage voltage.

    Also the seconds of compiling.
    """
    compiled = Trajectories(settled.eqs, count, seed, settled.h, circuit=circuit, controlled=True)
    with compilation() as compiling:
        compile_pair(compiled)
    take_states(compiled, settled)
    return compiled, compiling.seconds


def take_states(compiled: Trajectories, settled: Trajectories) -> None:
    """Put trajectories of a compiled circuit into states of an ideal one's, ``settled``, with the storage voltage."""
    circuit = compiled.circuit
    states = settled.state[: compiled.blocks]
    assert isinstance(circuit, CompiledCircuit), "the caller checks this"
    compiled.state[:, :2] = states[:, :2]
    compiled.state[:, circuit.rows :] = states[:, 5:]  # of several modes
    for k in range(
        RAMP
    ):  # Newton's method follows a slowly charged storage capacitor, but not a jump
        circuit.charge_store(compiled.state, (k + 1) / RAMP * states[:, 3])
        compiled.run(compiled.stride * compiled.h)


def settle_from(
    compiled: Trajectories, ideal: Trajectories, budget: float | None, begin: float
) -> None:
    """Burn in trajectories of a compiled circuit from those of its ``ideal`` elements, which have burnt in.

    The difference of the two circuits is forgotten in `SETTLING` time constants of the response or
    of the storage capacitor.

    Raises SimulationError if that would not end within ``budget`` seconds of ``begin``
    (`time.perf_counter`).
    """
    if compiled.h != ideal.h:
        compiled.restart(ideal.h)
    before = ideal.time
    slowest = memory(ideal, ideal.run(before), before)
    take_states(compiled, ideal)
    settle_within(compiled, SETTLING * max(slowest, compiled.loaded.memory), budget, begin)


def settle_within(
    compiled: Trajectories, length: float, budget: float | None, begin: float
) -> None:
    """Run trajectories for a ``length`` in `PARTS`.

    Raises SimulationError before a part if the rest would not end within ``budget`` seconds of
    ``begin`` (`time.perf_counter`).
    """
    now = time.perf_counter()
    for k in range(PARTS):
        check_cost(compiled, (1.0 - k / PARTS) * length, budget, now, now - begin)
        with stage(k / PARTS, (k + 1) / PARTS):
            compiled.run(length / PARTS, listener())
