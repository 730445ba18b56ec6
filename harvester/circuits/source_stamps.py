"""The terms of sources in the equations of their circuit: constant ones, controlled ones, and functions."""

from collections.abc import Mapping

from harvester.circuits.system import Function, Row, System
from harvester.netlists.expression_tree import Node, constant, operation, with_leaves
from harvester.netlists.part import CircuitPart, unserved


def voltage_source(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    """Add a source of constant voltage."""
    branch = system.branch(part.name)
    voltage = system.across_part(part)
    system.add(voltage, {branch: 1.0})
    system.add({branch: 1.0}, voltage)
    system.add_source({branch: 1.0}, _constant_source(part))


def current_source(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    """Add a source of constant current."""
    system.add_source(system.across_part(part), -_constant_source(part) * part.multiplicity)


def _constant_source(part: CircuitPart) -> float:
    if part.form:
        raise unserved(part, "is a source that changes with time")
    return part.number or 0.0


def controlled_voltage(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    """Add a voltage source that a voltage or a current controls."""
    branch = system.branch(part.name)
    voltage = system.across_part(part)
    system.add(voltage, {branch: 1.0})
    system.add({branch: 1.0}, voltage)
    control, gain = _control(part, system)
    system.add({branch: 1.0}, control, -gain)


def controlled_current(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    """Add a current source that a voltage or a current controls."""
    control, gain = _control(part, system)
    system.add(system.across_part(part), control, gain * part.multiplicity)


def _control(part: CircuitPart, system: System) -> tuple[Row, float]:
    """The row of the control of an E, F, G or H source, and its gain."""
    gain = part.number or 0.0
    if part.kind in "fh":
        return current_of(part.others[0], system), gain
    return system.across(*part.nodes[2:]), gain


def current_of(source: str, system: System) -> Row:
    """The row of the current of an element that has one among the unknowns."""
    return {system.branch(source): 1.0}


def behavioural(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    """Add a B source: a current from the first node to the second, or the voltage between them, that is a function."""

    def leaf(node: Node) -> Node:
        if node.operation == "i":
            return system.input(current_of(node.names[0], system))
        if node.operation != "v":
            raise unserved(part, "depends on the time, the temperature or a frequency")
        row = system.across(node.names[0], node.names[1] if len(node.names) > 1 else "0")
        return system.input(row) if row else constant(0.0)

    assert part.value is not None, "the reader checks this"
    tree = with_leaves(part.value, leaf)
    if part.form == "i" and part.multiplicity != 1.0:
        tree = operation("*", tree, constant(part.multiplicity))
    rows = system.across_part(part)
    if part.form == "v":
        branch = system.branch(part.name)
        system.add(rows, {branch: 1.0})
        system.add({branch: 1.0}, rows)
        rows = {branch: -1.0}
    if tree.is_constant:
        system.add_source(rows, -tree.value)
    elif rows:
        system.functions.append(Function(tree, rows))
