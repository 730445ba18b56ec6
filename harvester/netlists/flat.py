"""Flat netlists, as KiCad exports a board, made into the subcircuit of a load.

A flat netlist has no subcircuit around it, its nets are named as KiCad does (``/PZ_P``, ``Net-_D1-K_``), and it has a
ground of its own, which is no electrode of the piezo.  The user says which two nets the piezo is soldered to, which
resistor is the load, which capacitor the store, and which nets a supply feeds.  ngspice's node 0 is an electrode in the
whole circuit, so that the board's ground gets a name, and every voltage against it, of vendors' parts too, names it.

Source of the form: the SPICE netlists that KiCad 6 to 8 export, and the ngspice manual, chapter 2.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from harvester.errors import InputError, invalid, unknown
from harvester.netlists.board_ground import COMMON, VOLTAGE, referred
from harvester.netlists.read_lines import Line, net_of, ngspice_number, places_of_nodes
from harvester.netlists.subcircuits import BENCH, joined
from harvester.scene.load import Load

IGNORED = (*BENCH, ".probe", ".op", ".ac", ".dc")  # what a schematic asks of its own simulation
_FIRST = (".model", ".param")


@dataclass
class Board:
    """A flat netlist as a subcircuit: its ``lines``, and what its user's names have become.

    ``nets`` has the nodes by the net's name and ``elements`` those that were renamed, all in lower case; ``ground`` is
    the node of the board's own ground, "" where that is an electrode.
    """

    lines: list[Line]
    nets: dict[str, str] = field(default_factory=dict)
    elements: dict[str, str] = field(default_factory=dict)
    ground: str = ""


def as_subcircuit(file: str, lines: list[Line], load: Load, parts: list[str]) -> Board:
    """The board of a flat netlist's lines; ``parts`` are names of models that it may use without defining them.

    Raises InputError for nets and elements that the load names and the board lacks, for a board without a load or with
    several, for a source in the piezo's place, and for lines whose nodes are not known.
    """
    assert load.terminals is not None, "asked for with terminals only"
    outside, inner = _outside_and_inside(lines)
    models = {line.text.lower().split()[1] for line in lines if line.word == ".model" and len(line.text.split()) > 1}
    models |= set(parts)
    elements = _elements(file, outside, models)
    present = {net_of(element.tokens[k]): None for element in elements for k in element.nodes}
    first, second = (_known(f"net of load.terminals in netlist {file}", net, present) for net in load.terminals)
    if first == second:
        raise invalid("load.terminals", "be two different nets", ", ".join(load.terminals))
    names = _local_names(present, first, second)
    ground = "" if names["0"] == "n" else names["0"]
    renamed = _roles(file, elements, load)
    defaults, body = list[str](), list[Line]()
    for element in elements:
        _no_piezo(element, {first, second})
        body.append(_renamed(element, names, renamed, defaults))
    body += _supplies(file, load, present, names, {"0", first, second})
    if ground:
        body, inner = referred(body, inner, models)
    name = re.sub(r"\W", "_", f"flat_{file.rpartition('.')[0]}", flags=re.ASCII)
    header = Line(file, " ".join([f".subckt {name} p n", *defaults]))
    whole = [*_cards(outside), header, *body, Line(file, f".ends {name}"), *(line for lines in inner for line in lines)]
    return Board(whole, names, {old: new.lower() for old, new in renamed.items()}, ground)


class _Element(NamedTuple):
    """A line of an element: its words, and which of them are its nodes."""

    line: Line
    tokens: list[str]
    nodes: range


def _elements(file: str, outside: list[Line], models: set[str]) -> list[_Element]:
    """The elements outside of subcircuits."""
    lines = [(line, joined(line.text).split()) for line in outside if not line.word.startswith(".")]
    if not lines:
        raise InputError(f"netlist {file} must have elements outside of subcircuits, but has none: export it again")
    return [_Element(line, tokens, places_of_nodes(line, tokens, models)) for line, tokens in lines]


def _cards(outside: list[Line]) -> list[Line]:
    """The lines outside of subcircuits that are no element and stay: models and parameters first."""
    first = [line for line in outside if line.word in _FIRST]
    return first + [line for line in outside if line.word[0] == "." and line.word not in (*IGNORED, *_FIRST)]


def _renamed(element: _Element, names: dict[str, str], renamed: dict[str, str], defaults: list[str]) -> Line:
    """The element's line with the subcircuit's names; a value that becomes a parameter joins the ``defaults``."""
    new = [names[net_of(token)] if k in element.nodes else token for k, token in enumerate(element.tokens)]
    if (role := renamed.get(element.line.word)) is not None:
        new[0] = role
        if len(new) > 3 and ngspice_number(new[3]) is not None:
            letter = "R" if role == "Rload" else "C"
            defaults.append(f"{letter}={new[3]}")
            new[3] = f"{{{letter}}}"
    rest = len(element.nodes) + 1
    new[rest:] = [_expression(word, names, names["0"]) for word in new[rest:]]
    return Line(element.line.where, " ".join(new))


def _supplies(
    file: str, load: Load, present: dict[str, None], names: dict[str, str], taken: set[str]
) -> Iterator[Line]:
    """A voltage source for each net that a supply feeds."""
    for k, (net, volts) in enumerate(load.supplies.items()):
        node = _known(f"net of load.supplies in netlist {file}", net, present)
        if node in taken:
            raise invalid("load.supplies", "name a net that is neither ground nor a terminal of the piezo", net)
        yield Line(file, f"Vsupply{k + 1} {names[node]} {names['0']} {volts!r}")


def _outside_and_inside(lines: list[Line]) -> tuple[list[Line], list[list[Line]]]:
    """The lines outside of subcircuits, and those of each subcircuit."""
    outside: list[Line] = []
    inner: list[list[Line]] = []
    inside = False
    for line in lines:
        if line.word == ".subckt":
            inner.append([])
            inside = True
        (inner[-1] if inside else outside).append(line)
        inside = inside and line.word != ".ends"
    return outside, inner


def _known(kind: str, name: str, present: dict[str, None]) -> str:
    """The net that a user names, with or without the slash of KiCad's root sheet."""
    for spelling in (net_of(name), f"/{name.lower()}", name.lower().removeprefix("/")):
        if spelling in present:
            return spelling
    raise unknown(kind, name, present)


def _local_names(present: dict[str, None], first: str, second: str) -> dict[str, str]:
    """A node for each net: letters, digits and _, of which no two are the same."""
    names = {"0": COMMON, first: "p", second: "n"}
    used = {*names.values(), "0"}
    for net in present:
        if net not in names:
            plain = re.sub(r"[\W_]+", "_", net, flags=re.ASCII).strip("_") or "net"
            candidates = (plain if k == 0 else f"{plain}_{k + 1}" for k in range(len(present) + 4))
            name = names[net] = next(candidate for candidate in candidates if candidate not in used)
            used.add(name)
    return names


def _roles(file: str, elements: list[_Element], load: Load) -> dict[str, str]:
    """The board's names, in lower case, of the elements that become Rload and Csmooth."""
    roles: dict[str, str] = {}
    for role, letter, what, given in (
        ("Rload", "r", "resistor", load.resistor), ("Csmooth", "c", "store", load.store),
    ):  # fmt: skip
        there = {element.line.word: element.tokens[0] for element in elements if element.line.word[0] == letter}
        if given is not None:
            if given.lower() not in there:
                raise unknown(f"load.{what} of netlist {file}", given, there.values())
            if role.lower() in there and given.lower() != role.lower():
                raise InputError(f"load.{what} must be left out, as netlist {file} has an element {role} already")
            roles[given.lower()] = role
        elif role.lower() in there:
            roles[role.lower()] = role
        elif len(there) == 1:
            roles[next(iter(there))] = role
        elif role == "Rload":
            many = ", ".join(list(there.values())[:20]) or "none"
            raise InputError(
                f"load.resistor must name the resistor of netlist {file} whose power is asked for, as none there is "
                f"called Rload; its resistors: {many}"
            )
    return roles


def _no_piezo(element: _Element, piezo: set[str]) -> None:
    """Refuse a source where the piezo is."""
    if element.line.word[0] in "vi" and {net_of(element.tokens[k]) for k in element.nodes} == piezo:
        raise InputError(
            f"netlist {element.line.where} must have no source between the piezo's terminals, where the device itself "
            f"is, but has {element.tokens[0][:20]}: leave it out of the simulation"
        )


def _expression(text: str, names: dict[str, str], ground: str) -> str:
    """A word with v(net) against the board's ground."""

    def named(match: re.Match[str]) -> str:
        first, second = (None if name is None else names.get(net_of(name), name) for name in match.groups())
        return f"v({first},{second or ground})"

    return VOLTAGE.sub(named, text)
