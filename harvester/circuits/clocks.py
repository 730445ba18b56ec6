"""The clocks of a circuit: functions that count whole periods, as floor(v(phase)/16) of a chip.

A count is the argument of such a function.  It belongs to a clock if it rises at a steady rate;
one that only rounds a voltage does not.
"""

from itertools import pairwise

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.circuits.probed_path import tree_values

STEADY = 0.01  # largest relative difference between rates of a clock


class Clocks:
    """The counts of a compiled ``circuit``; none if its functions count nothing."""

    def __init__(self, circuit: CompiledCircuit) -> None:
        self._circuit = circuit
        self._counts = circuit.system.counts

    def __bool__(self) -> bool:
        return bool(self._counts)

    def counts(self, states: Floats) -> Floats:
        """The counts in states of the circuit, shape (n, length of a state): shape (n, counts)."""
        circuit = self._circuit
        rows = circuit.system.vectors([row for row, _ in circuit.system.inputs])
        inputs = circuit.unknowns(states) @ rows.T
        switches = states[:, circuit.switches_at : circuit.switches_at + circuit.sizes[2]]
        return np.stack([tree_values(node, inputs, switches) for node in self._counts], axis=1)

    def slowest(self, states: Floats, seconds: float | Floats) -> float:
        """The longest period (s) of a clock by n states, 0 without one.

        They are ``seconds`` apart: a number, or one for each interval, shape (n - 1, 1).
        """
        rates = np.diff(self.counts(states), axis=0) / seconds
        steady = [
            max(pair)
            for each in rates.T
            for pair in pairwise(sorted(each))
            if min(pair) > (1.0 - STEADY) * max(pair) > 0.0
        ]
        return 1.0 / min(steady) if steady else 0.0
