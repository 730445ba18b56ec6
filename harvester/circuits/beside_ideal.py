"""Trajectories of a compiled circuit that begin in states of the same circuit made of ideal elements."""

import numpy as np

from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.mechanics.ensemble.richardson import compile_pair
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.compiled import compilation

RAMP = 16  # parts in which a store is charged


def compiled_beside(
    settled: Trajectories, circuit: CompiledCircuit, count: int, seed: np.random.SeedSequence
) -> tuple[Trajectories, float]:
    """Trajectories of the compiled circuit in states of an ideal one's, ``settled``, with the store's voltage.

    Also the seconds of compiling.
    """
    own = Trajectories(settled.eqs, count, seed, settled.h, circuit=circuit, controlled=True)
    with compilation() as compiling:
        compile_pair(own)
    states = settled.state[: own.blocks]
    own.state[:, :2] = states[:, :2]
    own.state[:, circuit.rows :] = states[:, 5:]  # of several modes
    for k in range(RAMP):  # Newton's method goes with a store that is charged little by little, but not with a jump
        circuit.charge_store(own.state, (k + 1) / RAMP * states[:, 3])
        own.run(own.stride * own.h)
    return own, compiling.seconds
