"""What sources add to the equations of their circuit: constant ones, controlled ones, and functions."""

import re
from collections.abc import Mapping

from harvester.circuits.expression import Node, constant, read
from harvester.circuits.parts import CircuitPart, unserved
from harvester.circuits.system import Function, Row, System
from harvester.errors import InputError

_CHANGING = ("sin", "pulse", "exp", "pwl", "sffm", "am", "ac", "distof1", "distof2")


def voltage_source(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    """Add a source of constant voltage."""
    branch, voltage = system.branch(part.name), system.across(*part.nodes[:2])
    system.add(voltage, {branch: 1.0})
    system.add({branch: 1.0}, voltage)
    system.add_source({branch: 1.0}, _constant_source(part))


def current_source(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    """Add a source of constant current."""
    system.add_source(system.across(*part.nodes[:2]), -_constant_source(part))


def _constant_source(part: CircuitPart) -> float:
    words = [word for word in part.words if word != "dc"]
    if any(word.split("(")[0] in _CHANGING for word in re.split(r"[\s(]+", part.rest)):
        raise unserved(part, "is a source that changes with time")
    return part.number(words[0]) if words else part.options.get("dc", 0.0)


def controlled_voltage(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    """Add a source of voltage that a voltage or a current controls."""
    if _is_function(part):
        _function(part, system, "v", _tree(part, system, parts))
        return
    branch, voltage = system.branch(part.name), system.across(*part.nodes[:2])
    system.add(voltage, {branch: 1.0})
    system.add({branch: 1.0}, voltage)
    control, gain = _control(part, system, parts)
    system.add({branch: 1.0}, control, -gain)


def controlled_current(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    """Add a source of current that a voltage or a current controls."""
    if _is_function(part):
        _function(part, system, "i", _tree(part, system, parts))
        return
    control, gain = _control(part, system, parts)
    system.add(system.across(*part.nodes[:2]), control, gain)


def _is_function(part: CircuitPart) -> bool:
    return re.match(r"(value|vol|cur)\s*=", part.rest) is not None


def _control(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> tuple[Row, float]:
    """The row of what controls an E, F, G or H source, and its gain."""
    words = part.words
    if not words or words[0].startswith(("poly", "table", "laplace", "{", "'")):
        raise unserved(part, "has a polynomial, a table or another form: write it as a B source")
    if part.kind in "fh":
        return current_of(part, words[0], system, parts), part.number(words[1])
    return system.across(part.node(words[0]), part.node(words[1])), part.number(words[2])


def current_of(part: CircuitPart, source: str, system: System, parts: Mapping[str, CircuitPart]) -> Row:
    """The row of the current of a source of voltage."""
    name = part.path + source
    if name not in parts or parts[name].kind not in "vehlb":
        raise InputError(f"{part.where} must name a source of voltage in its subcircuit, but {source!r} is none")
    return {system.branch(name): 1.0}


def _tree(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart], text: str = "") -> Node:
    """The tree of an expression of voltages and currents, whose leaves are inputs of the equations."""

    def leaf(kind: str, words: tuple[str, ...]) -> Node:
        if kind == "i":
            return system.input(current_of(part, words[0], system, parts))
        nodes = [part.node(word) for word in words]
        row = system.across(nodes[0], nodes[1] if len(nodes) > 1 else "0")
        return system.input(row) if row else constant(0.0)

    text = text or part.rest.partition("=")[2]
    if re.search(r"\b(time|hertz)\b", text):
        raise unserved(part, "depends on the time, or a frequency")
    return read(text, part.where, part.values, leaf)


def behavioural(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    """Add a B source."""
    if (match := re.match(r"([vi])\s*=(.*)$", part.rest, re.DOTALL)) is None:
        raise unserved(part, "must begin with I= or V=")
    _function(part, system, match[1], _tree(part, system, parts, re.sub(r"\btc[12]=\S+", "", match[2])))


def _function(part: CircuitPart, system: System, kind: str, tree: Node) -> None:
    """A current from the first node to the second, or the voltage between them, that is a function."""
    rows = system.across(*part.nodes[:2])
    if kind == "v":
        branch = system.branch(part.name)
        system.add(rows, {branch: 1.0})
        system.add({branch: 1.0}, rows)
        rows = {branch: -1.0}
    if tree.operation == "constant":
        system.add_source(rows, -tree.value)
    elif rows:
        system.functions.append(Function(tree, rows))
