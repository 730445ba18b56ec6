"""What each element of a netlist adds to the equations of its circuit, by the letter of its kind.

An element, a model's parameter or a form of an element that is not among them raises `UnservedError`, which names it.
"""

import math
import re
from collections.abc import Callable, Mapping

from harvester.circuits import junctions
from harvester.circuits.expression import Node, constant, operation
from harvester.circuits.parts import CircuitPart, unserved
from harvester.circuits.source_stamps import (
    behavioural,
    controlled_current,
    controlled_voltage,
    current_of,
    current_source,
    voltage_source,
)
from harvester.circuits.system import GMIN, Function, Junction, Row, Switch, System
from harvester.circuits.transistors import Layer, add_junction, behind, bipolar, jfet, mosfet
from harvester.errors import InputError

LEAST_RESISTANCE = 1e-3  # ohm, which ngspice takes for 0
_DIODE = {"is", "js", "n", "rs", "cjo", "cj0", "cj", "vj", "pb", "m", "mj", "tt", "bv", "ibv", "fc", "nbv"}


def stamp(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    """Add an element to the equations; ``parts`` are all elements by their names.

    Raises UnservedError for one that compiled circuits do not have, and InputError for values that cannot be.
    """
    if part.kind not in _STAMPS:
        raise unserved(part, "is an element of a kind that compiled circuits do not have")
    if part.kind in "rcldqjm" and {"temp", "dtemp"} & part.options.keys():
        raise unserved(part, "has a temperature of its own")
    _STAMPS[part.kind](part, system, parts)


def value_of(part: CircuitPart, *names: str) -> float:
    """The value of a resistor, capacitor or coil."""
    options = part.options
    for name in names:
        if name in options:
            return options[name]
    words = part.words
    if not words:
        raise unserved(part, "has no value that is a number")
    if re.match(r"[a-z_]", words[0]):
        if words[0] in part.models:
            raise unserved(part, "has a model, which compiled circuits know for diodes, transistors and switches only")
        if words[0] not in part.values:
            raise unserved(part, f"has a value that is no number: {words[0]}")
    if "v(" in part.rest or "i(" in part.rest:
        raise unserved(part, "has a value that depends on voltages or currents")
    return part.number(words[0])


def _resistor(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    resistance = value_of(part, "r", "resistance") or LEAST_RESISTANCE
    row = system.across(*part.nodes[:2])
    system.add(row, row, part.options.get("m", 1.0) / resistance)


def _capacitor(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    capacitance = value_of(part, "c", "capacitance") * part.options.get("m", 1.0)
    row = system.across(*part.nodes[:2])
    if capacitance != 0.0 and row:
        charge = {k: v * capacitance for k, v in row.items()}
        start = capacitance * part.options.get("ic", 0.0)
        system.add_charge(part.name, row, charge, 1.0 / abs(capacitance), start)


def _inductor(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    branch = system.branch(part.name)
    voltage = system.across(*part.nodes[:2])
    system.add(voltage, {branch: 1.0})
    system.add({branch: 1.0}, voltage)
    inductance = _inductance(part)
    flux: Row = {branch: inductance}
    for coupling in parts.values():
        if coupling.kind == "k" and part.name in (names := _coupled(coupling)):
            _coupling(coupling, system, parts)
            other = parts[names[1] if names[0] == part.name else names[0]]
            factor = coupling.number(coupling.words[-1])
            flux[system.branch(other.name)] = factor * math.sqrt(abs(inductance * _inductance(other)))
    volts = 1.0 / math.sqrt(max(abs(inductance), 1e-15) * system.capacitance)  # of a coil that rings with the piezo
    system.add_charge(part.name, {branch: -1.0}, flux, volts, inductance * part.options.get("ic", 0.0))


def _inductance(part: CircuitPart) -> float:
    return value_of(part, "l", "inductance") / part.options.get("m", 1.0)


def _coupled(part: CircuitPart) -> tuple[str, str]:
    """The names of the two coils that a K element couples."""
    words = part.words
    if len(words) != 3:
        raise unserved(part, "must name two coils and a factor")
    return part.path + words[0], part.path + words[1]


def _coupling(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    for name in _coupled(part):
        if name not in parts:
            raise InputError(f"{part.where} must couple two coils of its subcircuit, but {name!r} is none")


def _switch(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    words, by_current = part.words, part.kind == "w"
    model = part.model(("csw",) if by_current else ("sw",), {"ron", "roff", "vt", "vh", "it", "ih"})
    control = current_of(part, words[0], system, parts) if by_current else system.across(*map(part.node, words[:2]))
    threshold, width = (model.values.get(key, 0.0) for key in (("it", "ih") if by_current else ("vt", "vh")))
    if width < 0.0:
        raise unserved(part, "has a negative hysteresis")
    closed, opened = 1.0 / model.values.get("ron", 1.0), 1.0 / model.values.get("roff", 1.0 / GMIN)
    row = system.across(*part.nodes[:2])
    system.switches.append(Switch(control, threshold + width, threshold - width, "on" in words[1:]))
    state = Node("state", index=len(system.switches) - 1)
    share = operation("+", constant(opened), operation("*", state, constant(closed - opened)))
    if row:
        system.functions.append(Function(operation("*", share, system.input(row)), row))


def diode_law(part: CircuitPart) -> tuple[float, float]:
    """Saturation current (A) and emission coefficient of a diode; raises as `CircuitPart.model`."""
    model = part.model(("d",), _DIODE)
    return model.value("is", "js", default=1e-14) * part.area, model.value("n", default=1.0)


def _diode(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    known, area = (model := part.model(("d",), _DIODE)).value, part.area
    anode, cathode = part.nodes[:2]
    anode = behind(system, anode, f"{part.name}#internal", known("rs") / area)
    saturation, emission = diode_law(part)
    thermal = emission * junctions.THERMAL
    breakdown, reverse = math.inf, known("nbv", default=known("n", default=1.0)) * junctions.THERMAL
    if "bv" in model.values:
        ibv = known("ibv", default=1e-3) * area
        breakdown = junctions.breakdown_voltage(saturation, reverse, model.values["bv"], ibv)
    layer = Layer(
        known("cjo", "cj0", "cj") * area, known("vj", "pb", default=1.0), known("m", "mj", default=0.5),
        min(known("fc", default=0.5), 0.95), known("tt"),
    )  # fmt: skip
    add_junction(system, system.across(anode, cathode), Junction(thermal, saturation, breakdown, reverse), layer)


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
