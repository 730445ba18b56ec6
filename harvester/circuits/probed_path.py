"""Quantities of a compiled circuit that a user names, along a path: voltages, and currents that its equations have."""

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.circuit_path import CircuitPath
from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.circuits.parts import CircuitPart, parts_of
from harvester.errors import InputError
from harvester.netlists.probes import Probe


def probed(circuit: CompiledCircuit, path: CircuitPath, probes: tuple[Probe, ...]) -> Floats:
    """The values of probes at the samples of a path that kept its states, shape (probes, n), in mid-drift.

    A current is that of a resistor, or of an element whose current is an unknown: a coil or a source of voltage.

    Raises InputError for the current or the power of another element.
    """
    if not probes:
        return np.empty((0, len(path.samples)))
    assert path.states is not None, "a path that is probed keeps its states"
    unknowns, system = circuit.unknowns(path.states), circuit.system
    parts = {part.name: part for part in parts_of(circuit.load)}
    none = np.zeros(len(unknowns))
    series = {"time": none}

    def voltage(node: str) -> Floats:
        return none if node == "0" else unknowns[:, system.unknowns[node]]

    def current(part: CircuitPart) -> Floats:
        if f"i({part.name})" in system.unknowns:
            return unknowns[:, system.unknowns[f"i({part.name})"]]
        if part.kind == "r":
            conductance = part.options.get("m", 1.0) / (part.number(part.words[0]) if part.words else np.inf)
            return (voltage(part.nodes[0]) - voltage(part.nodes[1])) * conductance
        raise InputError(
            f"`probe` must go with engine 'spice' for the current or power of {part.name}: engine 'compiled' tells "
            "those of resistors, coils and sources of voltage, and all voltages"
        )

    for probe in probes:
        for name in (probe.plus, probe.minus):
            node = name.removeprefix("xload.")
            series[name] = voltage("0" if node == circuit.load.ground else node) if name else none
        if probe.factor:
            element = probe.factor.partition(".xload.")[2].partition("[")[0]
            series[probe.factor] = current(parts[element])
    return np.array([probe.values(series) for probe in probes])
