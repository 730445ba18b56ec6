"""The terms of each element of a netlist in the equations of its circuit, by the letter of its kind.

An element, a model's parameter or a form of an element that is not among them raises
`UnservedError`, which names it.

Sources are constant ones, controlled ones, and functions.
"""

import math
from collections.abc import Callable, Mapping

from harvester.circuits import junctions
from harvester.circuits.semiconductors import area_of, model_of
from harvester.circuits.system import GMIN, PIEZO, Function, Junction, Row, Switch, System
from harvester.circuits.transistors import Layer, add_junction, behind, bipolar, jfet, mosfet
from harvester.errors import InputError
from harvester.netlists.expression_tree import Node, constant, operation, with_leaves
from harvester.netlists.part import CircuitPart, unserved


def voltage_source(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    """Add a source of constant voltage."""
    branch = _branch(part, system)
    system.add_source({branch: 1.0}, _constant_source(part))


def _branch(part: CircuitPart, system: System) -> int:
    """The current of a part as an unknown, with the equation of the voltage across it."""
    branch = system.branch(part.name)
    voltage = system.across_part(part)
    system.add(voltage, {branch: 1.0})
    system.add({branch: 1.0}, voltage)
    return branch


def current_source(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    """Add a source of constant current."""
    system.add_source(system.across_part(part), -_constant_source(part) * part.multiplicity)


def _constant_source(part: CircuitPart) -> float:
    if part.form:
        raise unserved(part, "is a source that changes with time")
    return part.number or 0.0


def controlled_voltage(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    """Add a voltage source that a voltage or a current controls."""
    branch = _branch(part, system)
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
        rows = {_branch(part, system): -1.0}
    if tree.is_constant:
        system.add_source(rows, -tree.value)
    elif rows:
        system.functions.append(Function(tree, rows))


LEAST_RESISTANCE = 1e-3  # ohm, which ngspice takes for 0
LEAST_SATURATION = 1e-28  # A, which ngspice takes for less, and for what is below 0
STEEPEST = 0.9  # the largest grading coefficient of a diode
_DIODE = {"is", "n", "rs", "cjo", "vj", "m", "tt", "bv", "ibv", "fc", "nbv", "area", "pj"}


def system_of(parts: dict[str, CircuitPart], capacitance: float) -> System:
    """The equations of a load circuit's elements next to a piezo of a capacitance (F).

    Raises UnservedError for a construct that compiled circuits lack; InputError for values that
    cannot be.
    """
    system = System(capacitance)
    across = system.across("p", "0")
    system.add_charge(
        PIEZO, across, {k: v * capacitance for k, v in across.items()}, 1.0 / capacitance
    )
    for part in parts.values():
        stamp(part, system, parts)
        system.elements[part.name] = len(system.diodes), len(system.functions)
    return system


def stamp(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    """Add an element to the equations; ``parts`` are all elements by their names.

    Raises UnservedError for one that compiled circuits do not have, and InputError for values that
    cannot be.
    """
    if part.kind not in _STAMPS:
        raise unserved(part, "is an element of a kind that compiled circuits do not have")
    _STAMPS[part.kind](part, system, parts)


def value_of(part: CircuitPart) -> float:
    """The value of a resistor, capacitor or inductor, all that are side by side."""
    if (value := part.effective_value) is not None:
        return value
    if part.form:
        raise unserved(part, "has a value that depends on voltages or currents")
    if part.number is None:
        raise unserved(
            part,
            "has a model for its value, which compiled circuits know for semiconductors and switches only",
        )
    raise unserved(part, "has a temperature of its own")


def _resistor(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    row = system.across_part(part)
    system.add(row, row, 1.0 / (value_of(part) or LEAST_RESISTANCE))


def _capacitor(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    capacitance = value_of(part)
    row = system.across_part(part)
    if capacitance != 0.0 and row:
        charge = {k: v * capacitance for k, v in row.items()}
        start = capacitance * part.options.get("ic", 0.0)
        system.add_charge(part.name, row, charge, 1.0 / abs(capacitance), start)


def _inductor(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    branch = _branch(part, system)
    inductance = value_of(part)
    flux: Row = {branch: inductance}
    for coupling in parts.values():
        if coupling.kind == "k" and part.name in coupling.others:
            other = parts[next(name for name in coupling.others if name != part.name)]
            factor = coupling.number or 0.0
            flux[system.branch(other.name)] = factor * math.sqrt(abs(inductance * value_of(other)))
    # of one that rings with the piezo
    volts = 1.0 / math.sqrt(max(abs(inductance), 1e-15) * system.capacitance)
    system.add_charge(
        part.name, {branch: -1.0}, flux, volts, inductance * part.options.get("ic", 0.0)
    )


def _coupling(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    """Nothing: the inductors that it couples have it in their fluxes."""


def _switch(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    by_current = part.kind == "w"
    model = model_of(
        part, ("csw",) if by_current else ("sw",), {"ron", "roff", "vt", "vh", "it", "ih"}
    )
    control = current_of(part.others[0], system) if by_current else system.across(*part.nodes[2:])
    threshold, width = (
        model.values.get(key, 0.0) for key in (("it", "ih") if by_current else ("vt", "vh"))
    )
    if width < 0.0:
        raise unserved(part, "has a negative hysteresis")
    if 0.0 in (model.values.get("ron"), model.values.get("roff")):
        raise InputError(f"{part.where} must have a model whose Ron and Roff are not 0")
    closed = 1.0 / model.values.get("ron", 1.0)
    opened = 1.0 / model.values.get("roff", 1.0 / GMIN)
    row = system.across_part(part)
    on = threshold + width
    off = threshold - width
    # ngspice begins with all voltages at 0
    closed_at_first = on < 0.0 or (off <= 0.0 and part.word == "on")
    system.switches.append(Switch(control, on, off, closed_at_first, part.name))
    state = Node("state", index=len(system.switches) - 1)
    share = operation("+", constant(opened), operation("*", state, constant(closed - opened)))
    if row:
        system.functions.append(Function(operation("*", share, system.input(row)), row))


def diode_law(part: CircuitPart) -> tuple[float, float]:
    """Saturation current (A) and emission coefficient of a diode; raises as `model_of`."""
    model = model_of(part, ("d",), _DIODE)
    saturation = max(model.value("is", default=1e-14), LEAST_SATURATION)
    return saturation * area_of(part), model.value("n", default=1.0)


def _diode(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    known = (model := model_of(part, ("d",), _DIODE)).value
    area = area_of(part)
    anode, cathode = part.nodes[:2]
    anode = behind(system, anode, f"{part.name}#internal", known("rs") / area)
    saturation, emission = diode_law(part)
    thermal = emission * junctions.THERMAL
    breakdown = math.inf
    reverse = known("nbv", default=known("n", default=1.0)) * junctions.THERMAL
    if "bv" in model.values:
        ibv = known("ibv", default=1e-3) * part.multiplicity  # not times the area, at level 1
        breakdown = junctions.breakdown_voltage(saturation, reverse, model.values["bv"], ibv)
    layer = Layer(
        known("cjo") * area, known("vj", default=1.0), min(known("m", default=0.5), STEEPEST),
        min(known("fc", default=0.5), 0.95), known("tt"),
    )  # fmt: skip
    add_junction(
        system,
        system.across(anode, cathode),
        Junction(thermal, saturation, breakdown, reverse),
        layer,
    )


_STAMPS: dict[str, Callable[[CircuitPart, System, Mapping[str, CircuitPart]], None]] = {
    "r": _resistor,
    "c": _capacitor,
    "l": _inductor,
    "k": _coupling,
    "v": voltage_source,
    "i": current_source,
    "e": controlled_voltage,
    "h": controlled_voltage,
    "g": controlled_current,
    "f": controlled_current,
    "b": behavioural,
    "s": _switch,
    "w": _switch,
    "d": _diode,
    "q": bipolar,
    "m": mosfet,
    "j": jfet,
}
