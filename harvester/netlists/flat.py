"""Flat netlists, as KiCad exports a board: which of its nets are the piezo's, and which elements are load and store.

A flat netlist has no subcircuit around it, its nets are named as KiCad does (``/PZ_P``,
``Net-_D1-K_``), and it has a ground of its own, which is not an electrode of the piezo.  The user
states which two nets the piezo is soldered to, which resistor is the load, which capacitor the
storage capacitor, and which nets a supply feeds.  Node 0 of the board, also in vendors' parts, is a
node of the whole circuit like any other, unless the piezo is soldered to it.

Source of the form: the SPICE netlists that KiCad 6 to 8 export, and the ngspice manual, chapter 2.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

from harvester.errors import InputError, invalid, unknown
from harvester.netlists.element_lines import Element
from harvester.netlists.expression_tree import constant
from harvester.netlists.netlist import ParsedNetlist
from harvester.netlists.part import GROUND, INSIDE, PIEZO
from harvester.netlists.read_lines import DeckError, Line
from harvester.scene.load import Load

COMMON = "board_ground"
LOAD, STORE = "rload", "csmooth"
ROLES = {LOAD: "R", STORE: "C"}  # the parameters of a board


@dataclass
class Board:
    """The meaning of the names of a flat netlist in the whole circuit.

    ``nodes`` are the nodes by the nets' names, ``renamed`` the elements that have another name
    there, all in lower case; ``ground`` is the node of the board's own ground, and ``roles`` are
    the parameters of load and store.

    A subcircuit is a board whose two terminals are the electrodes, and whose parameters are those
    of its header.
    """

    nodes: dict[str, str]
    renamed: dict[str, str] = field(default_factory=dict)
    ground: str = "0"
    roles: dict[str, str] = field(default_factory=dict)


def as_board(netlist: ParsedNetlist, load: Load) -> Board:
    """The board of a flat netlist, whose load and store get the names Rload and Csmooth in it, and supplies a source.

    Raises InputError for nets and elements that the load names and the board lacks, for a board
    without a load or with several, for a source in the piezo's place, and for lines whose nodes are
    not known.
    """
    assert load.terminals is not None, "asked for with terminals only"
    file = netlist.file
    elements = netlist.outside.elements
    if not elements:
        raise InputError(
            f"netlist {file} must have elements outside of subcircuits, but has none: export it again"
        )
    present = {net_of(node): None for element in elements for node in element.nodes}
    first, second = (
        _known(f"net of load.terminals in netlist {file}", net, present) for net in load.terminals
    )
    if first == second:
        raise invalid("load.terminals", "be two different nets", ", ".join(load.terminals))
    for net in netlist.settings.initial:
        _known(f"net of .ic in netlist {file}", net, present)
    nodes = _nodes([*present, *netlist.settings.everywhere], first, second)
    renamed = _roles(file, elements, load)
    for element in elements:
        _no_piezo(element, {first, second})
    netlist.outside.elements = [
        replace(element, name=renamed.get(element.name.lower(), element.name))
        for element in elements
    ] + list(_supplies(file, load, present, {"0", first, second}))
    return Board(nodes, {old: new.lower() for old, new in renamed.items()}, nodes["0"], ROLES)


def net_of(name: str) -> str:
    """The name of a net in lower case; ground is 0."""
    return "0" if name.lower() in GROUND else name.lower()


def _supplies(
    file: str, load: Load, present: dict[str, None], taken: set[str]
) -> Iterator[Element]:
    """A voltage source for each net that a supply feeds."""
    for k, (net, volts) in enumerate(load.supplies.items()):
        node = _known(f"net of load.supplies in netlist {file}", net, present)
        if node in taken:
            raise invalid(
                "load.supplies",
                "name a net that is neither ground nor a terminal of the piezo",
                net,
            )
        yield Element(
            Line(file, f"vsupply{k + 1}"), f"Vsupply{k + 1}", (node, "0"), constant(volts)
        )


def _known(kind: str, name: str, present: dict[str, None]) -> str:
    """The net that a user names, with or without the slash of KiCad's root sheet."""
    for spelling in (net_of(name), f"/{name.lower()}", name.lower().removeprefix("/")):
        if spelling in present:
            return spelling
    raise unknown(kind, name, present)


def _nodes(present: Iterable[str], first: str, second: str) -> dict[str, str]:
    """A node for each net: letters, digits and _, of which no two are the same."""
    names = {"0": INSIDE + COMMON, first: PIEZO, second: "0"}
    used = {COMMON, "0"}
    for net in present:
        if net not in names:
            plain = re.sub(r"[\W_]+", "_", net, flags=re.ASCII).strip("_") or "net"
            candidates = (plain if k == 0 else f"{plain}_{k + 1}" for k in range(len(used) + 1))
            name = next(candidate for candidate in candidates if candidate not in used)
            used.add(name)
            names[net] = INSIDE + name
    return names


def _roles(file: str, elements: list[Element], load: Load) -> dict[str, str]:
    """The board's names, in lower case, of the elements that become Rload and Csmooth."""
    roles: dict[str, str] = {}
    for role, letter, what, given in (
        ("Rload", "r", "resistor", load.resistor), ("Csmooth", "c", "store", load.store),
    ):  # fmt: skip
        there = {
            element.name.lower(): element.name for element in elements if element.kind == letter
        }
        if given is not None:
            if given.lower() not in there:
                raise unknown(f"load.{what} of netlist {file}", given, there.values())
            if role.lower() in there and given.lower() != role.lower():
                raise InputError(
                    f"load.{what} must be left out, as netlist {file} has an element {role} already"
                )
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


def _no_piezo(element: Element, piezo: set[str]) -> None:
    """Refuse a source in place of the piezo."""
    if element.kind in "vi" and {net_of(node) for node in element.nodes} == piezo:
        must = "have no source between the piezo's terminals, which the scene's device replaces"
        raise DeckError(f"{element.where} must {must}, but has {element.name[:20]}")
