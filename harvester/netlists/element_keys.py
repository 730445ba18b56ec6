"""Every resistor, capacitor, coil and constant source of a netlist is a parameter by its own name."""

from collections.abc import Iterable, Mapping

from harvester.netlists.read_lines import Line
from harvester.netlists.subcircuits import header_of, joined
from harvester.netlists.syntax import ngspice_number

KINDS = "rclvi"  # whose value is the word behind two nodes


def element_keys(body: list[Line]) -> dict[str, str]:
    """The elements of a subcircuit whose values are plain numbers: these, by the names as they are written."""
    words = [joined(line.text).split() for line in body[1:] if line.word[0] in KINDS]
    return {one[0]: one[3] for one in words if len(one) > 3 and ngspice_number(one[3]) is not None}


def with_elements_as_parameters(body: list[Line], names: Iterable[str]) -> list[Line]:
    """The subcircuit with a parameter for each element that is named, with its value as the default.

    A name that is a parameter already, or no such element, changes nothing.
    """
    known = {name.lower() for name in header_of(body[0]).defaults}
    asked = {name.lower() for name in names} - known
    found = {name: value for name, value in element_keys(body).items() if name.lower() in asked}
    if not found:
        return body
    defaults = " ".join(f"{name}={value}" for name, value in found.items())
    return [Line(body[0].where, f"{body[0].text} {defaults}"), *(_with_parameter(line, found) for line in body[1:])]


def _with_parameter(line: Line, found: Mapping[str, str]) -> Line:
    """An element's line, with its parameter in the place of its value where it is among those found."""
    words = joined(line.text).split()
    if words[0] not in found:
        return line
    words[3] = f"{{{words[0]}}}"
    return Line(line.where, " ".join(words))
