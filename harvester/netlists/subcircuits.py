"""The subcircuits of a netlist: where each begins and ends, its header, and what it takes from without.

In a load circuit every resistor, capacitor, coil and constant source of a netlist is a parameter by its own name.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from harvester.errors import invalid
from harvester.netlists.read_lines import Line, ngspice_number

KINDS = "rclvi"  # whose value is the word behind two nodes
DEFINITIONS = (".subckt", ".ends", ".model", ".param", ".include")  # cards that a load circuit may have
BENCH = (".tran", ".options", ".option", ".print", ".plot", ".meas", ".measure", ".save", ".ic", ".title", ".end")


class Header(NamedTuple):
    """The header of a subcircuit: name, terminals, and parameters with their defaults as written.

    The default None is that of a parameter that the scene must give.
    """

    name: str
    terminals: list[str]
    defaults: dict[str, str | None]


def header_of(line: Line) -> Header:
    """Read the header of a subcircuit from its .subckt line."""
    tokens = joined(line.text).split()[1:]
    split = next((k for k, token in enumerate(tokens) if token.lower() == "params:" or "=" in token), len(tokens))
    plain = tokens[:split]
    if not plain:
        raise invalid(f"netlist {line.where}", "have a name", line.text[:60])
    pairs = [token.partition("=") for token in tokens[split:] if token.lower() != "params:"]
    return Header(plain[0], plain[1:], {name: value if equals else None for name, equals, value in pairs})


def joined(text: str) -> str:
    """A line without blanks around = and within expressions, so that its tokens are its words."""
    text = re.sub(r"\{[^}]*\}|'[^']*'", lambda match: re.sub(r"\s+", "", match[0]), text)
    return re.sub(r"\s*=\s*", "=", text)


def split_subcircuits(file: str, lines: Iterable[Line]) -> tuple[dict[str, list[Line]], list[Line]]:
    """Return the lines of each subcircuit, by its name in lower case, and the lines outside of them.

    Raises InputError where subcircuits are nested, not ended, of the same name, or hold a card of the bench, and where
    ``file`` has none.
    """
    subcircuits: dict[str, list[Line]] = {}
    outside: list[Line] = []
    current: list[Line] | None = None
    for line in lines:
        if line.word == ".subckt":
            if current is not None:
                raise invalid(f"netlist {line.where}", "begin no subcircuit inside another", line.text[:60])
            name = header_of(line).name.lower()
            if name in subcircuits:
                raise invalid(f"netlist {line.where}", "have a subcircuit name of its own", name)
            subcircuits[name] = current = [line]
        elif line.word == ".ends":
            if current is None:
                raise invalid(f"netlist {line.where}", "end a subcircuit", ".ends without .subckt")
            current.append(line)
            current = None
        elif current is None:
            outside.append(line)
        else:
            if line.word in BENCH:
                cards = ", ".join(DEFINITIONS)
                raise invalid(f"netlist {line.where}", f"have only the cards {cards} inside", line.word)
            current.append(line)
    if current is not None or not subcircuits:
        raise invalid(f"netlist {file}", "hold a subcircuit, .subckt to .ends", "no end" if current else "none")
    return subcircuits, outside


def set_parameters(lines: Iterable[Line]) -> Iterator[str]:
    """Yield the names of the parameters that .param cards set."""
    for line in lines:
        if line.word == ".param":
            yield from (name.lower() for name in re.findall(r"(\w+)\s*=(?!=)", line.text))


def used_lines(load: list[Line], subcircuits: dict[str, list[Line]], outside: list[Line]) -> list[Line]:
    """The other subcircuits, models and parameters that the load names, and those that these name."""
    others: list[tuple[set[str], list[Line]]] = [
        ({name}, body) for name, body in subcircuits.items() if body is not load
    ]
    others += [({line.text.lower().split()[1]}, [line]) for line in outside if line.word == ".model"]
    others += [(set(set_parameters([line])), [line]) for line in outside if line.word == ".param"]
    used: list[Line] = []
    new = [load]
    while new:
        named = set().union(*(_outer_names(body) for body in new))
        new = [body for names, body in others if names & named]
        others = [other for other in others if not other[0] & named]
        used += [line for body in new for line in body]
    return used


def _outer_names(body: list[Line]) -> set[str]:
    """Names that a subcircuit, or a line outside, takes from without: all but its own parameters."""
    known = set(set_parameters(body))
    if body[0].word == ".subckt":
        known |= {name.lower() for name in header_of(body[0]).defaults}
    return {name.lower() for line in body for name in re.findall(r"[\w.]+", line.text)} - known


def element_keys(body: list[Line]) -> dict[str, str]:
    """The elements of a subcircuit whose values are plain numbers: these, by the names as they are written."""
    words = [joined(line.text).split() for line in body[1:] if line.word[0] in KINDS]
    return {tokens[0]: tokens[3] for tokens in words if len(tokens) > 3 and ngspice_number(tokens[3]) is not None}


def with_elements_as_parameters(body: list[Line], names: Iterable[str]) -> list[Line]:
    """The subcircuit with a parameter for each element that is named, with its value as the default.

    A name that is a parameter already, or no such element, changes nothing.
    """
    known = {name.lower() for name in header_of(body[0]).defaults}
    missing = {name.lower() for name in names} - known
    values = {name: value for name, value in element_keys(body).items() if name.lower() in missing}
    if not values:
        return body
    defaults = " ".join(f"{name}={value}" for name, value in values.items())
    return [Line(body[0].where, f"{body[0].text} {defaults}"), *(_with_parameter(line, values) for line in body[1:])]


def _with_parameter(line: Line, values: Mapping[str, str]) -> Line:
    """An element's line, with its parameter in the place of its value where it is among the ``values``."""
    words = joined(line.text).split()
    if words[0] not in values:
        return line
    words[3] = f"{{{words[0]}}}"
    return Line(line.where, " ".join(words))
