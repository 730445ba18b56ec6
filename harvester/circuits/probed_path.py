"""Quantities of a compiled circuit that a user names, along a trajectory, and the powers that its elements dissipate.

For the equations P z' + G y + A (i(w) + q(w)') = s + b u an element k has its own part, and it
dissipates

    sum over the nodes of y (G_k y + A_k i_k(w) - s_k)

without that of its charges, which is zero on average.
"""

from functools import partial

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.circuit_path import CircuitPath
from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.circuits.junctions import diode
from harvester.circuits.stamps import stamp, value_of
from harvester.circuits.system import System
from harvester.errors import InputError
from harvester.mechanics.kernels.compiled import interpreted
from harvester.netlists.expression_tree import Node
from harvester.netlists.folding import constant_of
from harvester.netlists.part import CircuitPart, by_name
from harvester.netlists.probes import Probe


def probed(circuit: CompiledCircuit, path: CircuitPath, probes: tuple[Probe, ...]) -> Floats:
    """The values of probes at the samples of a trajectory that kept its states, shape (probes, n), in mid-drift.

    A current is that of a resistor, or of an element whose current is an unknown: an inductor or a
    voltage source.

    Raises InputError for the current or the power of another element.
    """
    if not probes:
        return np.empty((0, len(path.samples)))
    assert path.states is not None, "a path that is probed keeps its states"
    unknowns = circuit.unknowns(path.states)
    system = circuit.system
    parts = by_name(circuit.load.parts)
    none = np.zeros(len(unknowns))
    series = {"time": none}

    def voltage(node: str) -> Floats:
        return none if node == "0" else unknowns[:, system.unknowns[node]]

    def current(part: CircuitPart) -> Floats:
        if f"i({part.name})" in system.unknowns:
            return unknowns[:, system.unknowns[f"i({part.name})"]]
        if part.kind == "r":
            return (voltage(part.nodes[0]) - voltage(part.nodes[1])) / value_of(part)
        raise InputError(
            f"`probe` must be used with engine 'spice' for the current or power of {part.name}: engine 'compiled' has "
            "those of resistors, coils and voltage sources, and all voltages"
        )

    for probe in probes:
        for name in (probe.plus, probe.minus):
            series[name] = voltage(name) if name else none
        if probe.factor:
            element = probe.factor.partition(".xload.")[2].partition("[")[0]
            series[probe.factor] = current(parts[element])
    return np.array([probe.values(series) for probe in probes])


def mean_powers(circuit: CompiledCircuit, path: CircuitPath) -> dict[str, float]:
    """The mean powers (W) of elements along a trajectory that kept the circuit's own steps, as of `powers_of_elements`.

    By the trapezoidal rule; in the first step after a switch acted, whose power jumps, by the power
    at its end.
    """
    assert path.own_steps is not None, "a path whose elements are asked for keeps them"
    (ns, n, many, _) = circuit.sizes
    seconds = path.own_steps[1:, 0]
    states = path.own_steps[:, 1:]
    switches = states[:, ns + n : ns + n + many]
    jumps = (switches[1:] != switches[:-1]).any(axis=1)
    return {
        name: float(
            np.average(np.where(jumps, power[1:], 0.5 * (power[1:] + power[:-1])), weights=seconds)
        )
        for name, power in powers_of_elements(circuit, states).items()
    }


def powers_of_elements(circuit: CompiledCircuit, states: Floats) -> dict[str, Floats]:
    """The powers (W) of elements in states of the circuit, shape (n,) each.

    Those of charges alone are left out.

    ``states`` have the shape (n, length of a state).
    """
    whole = circuit.system
    y = circuit.unknowns(states)
    powers = dict[str, Floats]()
    ns, n, many, _ = circuit.sizes
    w = y @ whole.vectors([row for row, _ in whole.inputs]).T
    switched = states[:, ns + n : ns + n + many]
    parts = by_name(circuit.load.parts)
    before = 0
    for part in parts.values():
        alone = System(
            whole.capacitance,
            dict(whole.unknowns),
            inputs=[*whole.inputs],
            owners=dict(whole.owners),
        )
        alone.switches = whole.switches[:before]
        stamp(part, alone, parts)
        before = len(alone.switches)
        currents = [
            (tree_values(function.tree, w, switched), function.rows) for function in alone.functions
        ]
        currents += [
            (_static(w[:, diode.input], diode.arguments), diode.rows) for diode in alone.diodes
        ]
        currents += [(np.full(len(y), -1.0), alone.sources)]
        currents += [
            (value * (y @ alone.vectors([row])[0]), rows) for rows, row, value in alone.conductances
        ]
        taken = [
            current * a * y[:, i]
            for current, rows in currents
            for i, a in rows.items()
            if i not in alone.owners
        ]
        if taken:
            powers[part.name] = np.sum(taken, axis=0)
    return powers


def _static(v: Floats, arguments: tuple[float, ...]) -> Floats:
    """The current of a junction at its voltages, without that of its charge."""
    return np.asarray(np.vectorize(interpreted(diode), otypes=4 * [float])(v, *arguments)[0])


def tree_values(tree: Node, w: Floats, switches: Floats) -> Floats:
    """The values of a tree at inputs, shape (n, inputs), and states of the switches."""
    if not tree.arguments:
        leaves = {"input": w, "state": switches}
        return (
            leaves[tree.operation][:, tree.index]
            if tree.operation in leaves
            else np.full(len(w), tree.value)
        )
    values = (tree_values(argument, w, switches) for argument in tree.arguments)
    return np.asarray(np.vectorize(partial(constant_of, tree.operation), otypes=[float])(*values))
